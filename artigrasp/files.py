"""How every file of the project is written (whole or not at all) and recognised (format and version)."""

import errno
import operator
import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from artigrasp.errors import UserError

LEFTOVER_AGE = 3600.0
"""A temporary file that is older belongs to a process that was killed [s]."""
FULL_DISK = 1 << 18
"""A disk with less free space is full [bytes]: what fails to be written there failed for that."""
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}(\.\w+)?")


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file so that nobody ever sees half of it.

    Missing parent folders are made. Only whole files take the name ``path``: a block that raises leaves an existing
    file as it was.

    Args:
        path: The file to write or replace.

    Yields:
        A path beside ``path``, with the same suffix, at which the caller writes a new file.

    Raises:
        UserError: The folder cannot be made or written to, or its disk is full.
    """
    path = Path(path)
    check_target(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{path.parent}: cannot make this folder: {error.strerror}") from error
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    try:
        yield temporary
        # "r+b": Windows syncs only handles that may write.
        with temporary.open("r+b") as written:
            os.fsync(written.fileno())
        os.replace(temporary, path)
    except Exception as error:
        if _disk_is_full(error, path.parent):
            raise UserError(f"{path}: cannot write this file: no space left on its disk") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _disk_is_full(error: Exception, folder: Path) -> bool:
    """Whether it was for want of space that a file could not be written; some libraries do not tell."""
    told = isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return told or shutil.disk_usage(folder).free < FULL_DISK


def remove_leftovers(folder: Path) -> None:
    """Remove what processes that were killed in the middle of :func:`atomic_write` left below a folder."""
    for path in folder.rglob(".*"):
        # Others may remove it at the same time, or own it.
        with suppress(OSError):
            if _TEMPORARY.fullmatch(path.name) and path.is_file() and time.time() - path.stat().st_mtime > LEFTOVER_AGE:
                path.unlink()


def check_target(path: str | os.PathLike[str]) -> None:
    """Refuse a file that could not be written, before the work that it is to hold; nothing is made.

    Args:
        path: The file to write or replace.

    Raises:
        UserError: It is a folder, or what should be its folder is a file or cannot be written to.
    """
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path}: expected a file to write, found a folder")
    nearest = next(parent for parent in path.absolute().parents if parent.exists())
    if not nearest.is_dir():
        raise UserError(f"{nearest}: expected a folder to write to, found a file")
    if not os.access(nearest, os.W_OK):
        raise UserError(f"{nearest}: cannot write to this folder: permission denied")


def check_format(
    found_format: object, found_version: object, format: str, version: int, path: str | os.PathLike[str]
) -> None:
    """Refuse a file of another kind, or one that a newer program wrote.

    Args:
        found_format: The file's ``format`` field, None if it has none; a zero-dimensional array counts as its item.
        found_version: The file's ``version`` field, likewise.
        format: Format that the caller reads.
        version: Newest version of it that the caller reads; older ones, from 1, pass.
        path: The file, for the message.

    Raises:
        UserError: The format differs, or the version is newer or no version at all.
    """
    if str(found_format) != format:
        raise UserError(f"{path}: format: expected {format!r}, found {_show(found_format)}")
    try:
        number = operator.index(found_version)  # type: ignore[arg-type]
    except TypeError:
        number = 0
    if number < 1:
        raise UserError(f"{path}: version: expected a whole number from 1, found {_show(found_version)}")
    if number > version:
        raise UserError(
            f"{path}: version: expected at most {version}, found {number}: a newer version of artigrasp wrote this file"
        )


def _show(value: object) -> str:
    return "none" if value is None else repr(str(value))
