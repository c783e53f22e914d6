"""The import of a user's copy of ARCTIC: hands, objects and references, each made once."""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from artigrasp.assets import arctic as assets
from artigrasp.assets import decomposition
from artigrasp.assets.hand import write_hand
from artigrasp.assets.library import SUFFIX, AssetKind, import_root
from artigrasp.assets.object import read_object, write_object
from artigrasp.errors import UserError, unknown
from artigrasp.files import atomic_write
from artigrasp.kernels.layout import HANDS
from artigrasp.references.arctic_labels import LABELS, convert_references, mean_pose_path, read_labels, read_mean_pose
from artigrasp.references.reference import save_references

IMPORTER_VERSION = 1
"""Raised when the same source gives other files than before, so that they are made anew."""

MANIFEST_FORMAT, MANIFEST_VERSION = "artigrasp.manifest", 1

Progress = Callable[[str, int, int], None]
"""Told what is being made, and how many of how many products are done."""


@dataclass(frozen=True)
class ImportReport:
    """What an import did.

    Attributes:
        destination: Folder of ``hands/``, ``objects/`` and ``references/``.
        written: Files that were made, relative to it.
        unchanged: Files that were there already, made of the same data.
        skipped: Labels that gave no reference, each with the reason.
    """

    destination: Path
    written: tuple[str, ...]
    unchanged: tuple[str, ...]
    skipped: tuple[str, ...]


def import_arctic(
    source: Path,
    objects: Iterable[str] | None = None,
    destination: Path | None = None,
    progress: Progress | None = None,
) -> ImportReport:
    """Convert a user's copy of the ArtiGrasp release to hands, objects and references.

    Files that were made of the same data before are left alone.

    Args:
        source: Folder that holds ``rsc/`` and ``labelled_frames.npz``.
        objects: Objects to import; all by default.
        destination: Where to; the import root by default.
        progress: Called before each file and at the end.

    Raises:
        UserError: something is missing or malformed. Files that were finished by then stay.
    """
    names = assets.object_names(source)
    wanted = names if objects is None else list(objects)
    for name in wanted:
        if name not in names:
            raise unknown("object", name, names)
    destination = import_root() if destination is None else destination
    labels = read_labels(source)
    mean_pose = {side: read_mean_pose(source, side) for side in HANDS}
    manifest = _Manifest(destination)
    skipped: list[str] = []

    def make_hand(side: str, path: Path) -> None:
        write_hand(assets.convert_hand(source, side, path))

    def make_object(name: str, path: Path) -> None:
        write_object(assets.convert_object(source, name, path))

    def make_references(name: str, path: Path) -> None:
        model = read_object(_product(destination, "objects", name))
        references, without = convert_references(source, model, labels, mean_pose)
        save_references(path, references)
        skipped.extend(without)

    products: list[tuple[Callable[[str, Path], None], str, Path, list[Path]]] = []
    for side in HANDS:
        path = _product(destination, "hands", f"{assets.HAND_NAME}_{side}")
        products.append((make_hand, side, path, [assets.hand_urdf(source, side)]))
    for name in wanted:
        sources = assets.object_sources(source, name)
        products.append((make_object, name, _product(destination, "objects", name), sources))
        sources = [*sources, source / LABELS, *(mean_pose_path(source, side) for side in HANDS)]
        sources += sorted(assets.object_folder(source, name).glob("*/*.object.npy"))
        products.append((make_references, name, _product(destination, "references", name), sources))

    written, unchanged = [], []
    for index, (make, name, path, sources) in enumerate(products):
        relative = path.relative_to(destination).as_posix()
        if progress is not None:
            progress(relative, index, len(products))
        digest = _digest(sources)
        if manifest.has(path, digest):
            unchanged.append(relative)
            continue
        make(name, path)
        manifest.add(path, digest)
        written.append(relative)
    if progress is not None:
        progress("done", len(products), len(products))
    return ImportReport(destination, tuple(written), tuple(unchanged), tuple(skipped))


def _product(destination: Path, kind: AssetKind, name: str) -> Path:
    return destination / kind / f"{name}{SUFFIX[kind]}"


def _digest(sources: list[Path]) -> str:
    """A hash of everything that an imported file depends on."""
    digest = hashlib.sha256(json.dumps([IMPORTER_VERSION, decomposition.SETTINGS], sort_keys=True).encode())
    for path in sources:
        if not path.is_file():
            raise UserError(f"{path}: expected a file of the release, found nothing")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


class _Manifest:
    """Remembers of which data each imported file was made."""

    def __init__(self, destination: Path) -> None:
        self._path = destination / "manifest.json"
        self._digests: dict[str, str] = {}
        try:
            data = json.loads(self._path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        if isinstance(data, dict) and (data.get("format"), data.get("version")) == (MANIFEST_FORMAT, MANIFEST_VERSION):
            self._digests = data.get("files", {})

    def has(self, path: Path, digest: str) -> bool:
        """Whether this file is there and was made of this data."""
        return path.is_file() and self._digests.get(self._key(path)) == digest

    def add(self, path: Path, digest: str) -> None:
        """Note that this file was made of this data."""
        self._digests[self._key(path)] = digest
        data = {"format": MANIFEST_FORMAT, "version": MANIFEST_VERSION, "files": self._digests}
        with atomic_write(self._path) as temporary:
            temporary.write_text(json.dumps(data, indent=1, sort_keys=True), encoding="utf-8")

    def _key(self, path: Path) -> str:
        return path.relative_to(self._path.parent).as_posix()
