"""What an import made, of what, and how well: so that importing again makes only what has changed."""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from artigrasp.errors import UserError
from artigrasp.files import write_text

FORMAT, VERSION = "artigrasp.manifest", 3


def digest_files(paths: Iterable[Path], *settings: object) -> str:
    """A hash of the contents of files, and of everything else that a product depends on.

    Raises:
        UserError: a file cannot be read.
    """
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for path in paths:
        try:
            with path.open("rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
        except OSError as error:
            raise UserError(f"{path}: cannot read this file: {error.strerror}") from None
    return digest.hexdigest()


class Manifest:
    """The file ``manifest.json`` of a folder of imported files.

    It is ``{"format", "version", "digest", "files": {path: {"sources": hash, "content": hash, ...}}}``, with paths
    relative to the folder. An object has ``"parts": {part: fidelity}`` too. One that cannot be read, or whose files are
    not those of its digest, counts as empty.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "manifest.json"
        self._files: dict[str, dict[str, Any]] = {}
        try:
            data = json.loads(self._path.read_text(encoding="utf-8"))
            if isinstance(data, dict) and data == _document(data.get("files")):
                self._files = data["files"]
        except (OSError, ValueError, RecursionError):
            pass

    def has(self, path: Path, sources: str) -> bool:
        """Whether this file was made of these sources, and has not changed since."""
        entry = self._files.get(self._name(path), {})
        return entry.get("sources") == sources and path.is_file() and entry.get("content") == digest_files([path])

    def add(self, path: Path, sources: str, **more: object) -> None:
        """Note that this file was made of these sources, and whatever else is to be kept about it."""
        self._files[self._name(path)] = {"sources": sources, "content": digest_files([path]), **more}
        write_text(self._path, json.dumps(_document(self._files), indent=1, sort_keys=True))

    def note(self, path: Path, name: str) -> Any:
        """What was kept about a file under this name, or None."""
        return self._files.get(self._name(path), {}).get(name)

    def _name(self, path: Path) -> str:
        return path.relative_to(self._path.parent).as_posix()


def _document(files: Any) -> dict[str, Any]:
    return {"format": FORMAT, "version": VERSION, "digest": digest_files([], files), "files": files}
