"""USD files of strangers, opened in a process of their own.

Pixar's reader of binary USD is not made for damaged files, or for those of enemies: it may take forever, or all memory,
or end its process. So a child composes the file under limits and writes the stage as text, which this process reads:

    python -m artigrasp.assets.foreign_stage FILE ROOT TEXT
"""

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from pxr import Usd

from artigrasp.assets.usd_stage import open_stage
from artigrasp.errors import UserError

if sys.platform != "win32":
    import resource

SECONDS = 20
"""Processor time that a file may take to be opened [s]."""
PATIENCE = 10
"""So many times longer may it take in all, where other processes want the processor."""
MEMORY = 8 * 2**30
"""Address space that a file may take [bytes]; libraries alone take a few GiB of it."""
_REFUSED = 2
"""Exit code of a child that says why on standard output."""


@contextlib.contextmanager
def foreign_stage(path: Path, root: Path | None = None) -> Iterator[Usd.Stage]:
    """Open a USD file, and with it the files that it is composed of, for a while.

    Windows knows no limits but that of time.

    Args:
        path: The file.
        root: Folder that holds everything that it may be composed of, by default its own.

    Yields:
        One layer in which everything is, the references among its own prims apart.

    Raises:
        UserError: as for :func:`open_stage`, or it took too long or too much memory.
    """
    with tempfile.TemporaryDirectory() as folder:
        text = Path(folder) / "stage.usda"
        # -P: not the module of that name in the folder that the user is in
        words = [sys.executable, "-P", "-m", __name__, str(path), str(root or path.parent), str(text)]
        try:
            child = subprocess.run(
                words,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                encoding="utf-8",
                timeout=PATIENCE * SECONDS,
            )
        except subprocess.TimeoutExpired:
            raise UserError(f"{path}: cannot read this as USD: it takes too long") from None
        if child.returncode == _REFUSED:
            raise UserError(child.stdout)
        if child.returncode != 0:
            raise UserError(f"{path}: cannot read this as USD: it takes too long, too much memory, or ends its reader")
        try:
            stage = open_stage(text)
        except UserError:
            raise UserError(f"{path}: cannot read this as USD: it holds values of other types than it says") from None
        yield stage


def _write_text(path: Path, root: Path, text: Path) -> int:
    """Open a file under limits and write its stage as text; the exit code."""
    if sys.platform != "win32":
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        stage = open_stage(path, root)
    except UserError as error:
        sys.stdout.write(str(error))
        return _REFUSED
    text.write_text(stage.Flatten().ExportToString(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(_write_text(*map(Path, sys.argv[1:])))
