"""How programs here end when they are asked for what cannot be done."""

import argparse
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from artigrasp.errors import UserError


@contextmanager
def exits_on_error(parser: argparse.ArgumentParser) -> Iterator[None]:
    """End with one line and the status of the command line: 2 for a user's mistake, 1 for a command that failed."""
    try:
        yield
    except UserError as error:
        parser.exit(2, f"error: {error}\n")
    except subprocess.CalledProcessError as error:
        parser.exit(1, f"error: {' '.join(error.cmd)} failed\n")
