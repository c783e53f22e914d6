"""How every file of the project is written (whole or not at all) and recognised (format and version)."""

import csv
import errno
import json
import operator
import os
import re
import secrets
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

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
    check_folder(path.absolute().parent)


def check_folder(folder: Path) -> None:
    """Refuse a folder that could not be made or written to, before the work whose files it is to hold; nothing is made.

    Raises:
        UserError: It is a file or below one, or cannot be written to.
    """
    folder = folder.absolute()
    nearest = next(each for each in (folder, *folder.parents) if each.exists())
    if not nearest.is_dir():
        raise UserError(f"{nearest}: expected a folder to write to, found a file")
    if not os.access(nearest, os.W_OK):
        raise UserError(f"{nearest}: cannot write to this folder: permission denied")


def check_inside(path: str | os.PathLike[str], folder: Path, source: str | os.PathLike[str]) -> None:
    """Refuse a file to which another one refers, if it lies outside a folder; links count as what they lead to.

    Args:
        path: The file.
        folder: Folder that holds everything that the other may refer to.
        source: The other file, for the message.

    Raises:
        UserError: It lies outside.
    """
    if not Path(path).resolve().is_relative_to(folder.resolve()):
        raise UserError(f"{source}: expected files in {folder} only, found a reference to {path}")


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


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Args:
        path: The file.
        text: All of it.

    Raises:
        UserError: The place cannot be written to.
    """
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file that :func:`read_json` reads, whole or not at all.

    Args:
        path: The file.
        content: Its table, ``format`` and ``version`` included; numbers must be finite, for JSON has no others.

    Raises:
        UserError: The place cannot be written to.
    """
    write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def read_json(path: Path, format: str, version: int, what: str) -> dict[str, Any]:
    """Read a JSON file of a known kind.

    Args:
        path: The file.
        format: Kind that the file must be of.
        version: Newest version that the caller reads.
        what: The file in words, such as ``"a task"``, for the message when there is none.

    Returns:
        Its table, without ``format`` and ``version``.

    Raises:
        UserError: There is no such file, it is no JSON table, or of another format or a newer version.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: expected {what}, found none to read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: expected JSON, found something else: {error}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a table of keys and values, found {type(content).__name__}")
    check_format(content.pop("format", None), content.pop("version", None), format, version, path)
    return content


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a table that :func:`read_csv` reads, whole or not at all.

    Args:
        path: The file.
        columns: Names of the columns.
        rows: A value for each column; None leaves it empty.

    Raises:
        UserError: The place cannot be written to.
    """
    with atomic_write(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)


def read_csv(path: Path, what: str) -> list[dict[str, str]]:
    """Read a table whose first row names its columns.

    Args:
        path: The file.
        what: As for :func:`read_json`.

    Returns:
        The rows, each with every column.

    Raises:
        UserError: There is no such file, or it is no such table.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise UserError(f"{path}: expected {what}, found none to read: {error.strerror}") from error
    except (ValueError, csv.Error) as error:
        raise UserError(f"{path}: expected a table in CSV, found something else: {error}") from error
    for number, row in enumerate(rows, start=1):
        # where a row is too long the rest stands under no name, where it is too short nothing stands under some
        if None in row or None in row.values():
            raise UserError(f"{path}: row {number}: expected a value for each column, found more or fewer")
    return rows


def _show(value: object) -> str:
    return "none" if value is None else repr(str(value))
