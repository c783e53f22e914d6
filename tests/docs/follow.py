"""Does what a document says: its snippets of Python, then its commands; ``python -m tests.docs.follow DOCUMENT``."""

import os
import sys
from pathlib import Path
from unittest.mock import patch

from artigrasp.cli import main
from tests.docs.blocks import read_blocks
from tests.docs.commands import ROOT, Command, read_commands

FEWER = {"train": "--iterations 1 --worlds 4 --threads 1", "evaluate": "--per-object 1 --threads 1"}
"""What else a verb is told, so that there is less of it; of the others what comes after them needs what they write."""


def follow(document: Path) -> None:
    """Run every snippet and every command of a document's blocks, in the present folder."""
    for block in read_blocks(document):
        if block.language == "python" and not block.title:
            exec(compile(block.text, str(document), "exec"), {"__name__": "__main__"})
    for command in read_commands(document, prose=False):
        if command.program == "artigrasp":
            run(command)


def run(command: Command) -> None:
    """Run a command, mostly with little of everything.

    Raises:
        SystemExit: It failed.
    """
    with patch.dict(os.environ, command.environment):
        code = main([*command.words, *FEWER.get(command.words[0], "").split()])
    if code:
        sys.exit(f"{command}: exit code {code}")


if __name__ == "__main__":
    follow(ROOT / sys.argv[1])
