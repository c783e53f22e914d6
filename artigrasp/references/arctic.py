"""The import of a user's copy of ARCTIC: hands, objects and references, each made once."""

import os
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from artigrasp.assets.arctic import HAND_NAME, ArcticSource, find_source, object_files, object_names
from artigrasp.assets.arctic_hand import (
    find_hand_files,
    load_mean_pose,
    mean_pose_path,
    read_arctic_hand,
    save_mean_pose,
)
from artigrasp.assets.arctic_object import make_object, read_arctic_object
from artigrasp.assets.cutting import cut_meshes
from artigrasp.assets.decomposition import SETTINGS, convex_pieces
from artigrasp.assets.fidelity import measure_fidelity
from artigrasp.assets.hand import write_hand
from artigrasp.assets.library import SUFFIX, AssetKind, import_root
from artigrasp.assets.object import read_object, write_object
from artigrasp.assets.skin_drawing import draw_skin
from artigrasp.errors import UserError, unknown
from artigrasp.files import check_folder, remove_leftovers
from artigrasp.kernels.layout import HANDS, PARTS
from artigrasp.references.arctic_labels import label_files, labelled_objects, read_labelled_frames
from artigrasp.references.arctic_references import make_references
from artigrasp.references.arctic_sequence import object_sequence_files
from artigrasp.references.manifest import Manifest, digest_files
from artigrasp.references.reference import save_references

IMPORTER_VERSION = 4
"""Raised when the same source gives other files than before, so that they are made anew."""

Progress = Callable[[str, int, int], None]
"""Told what is being made, and how many of how many products are done."""


@dataclass
class ImportReport:
    """What an import did.

    Attributes:
        destination: Folder of ``hands/``, ``objects/`` and ``references/``.
        written: Files that were made, relative to it.
        unchanged: Files that were there already, made of the same data.
        skipped: What could not be made of the data, and why.
        parts: How closely the collision pieces follow each part, by object and part: the fields of
            :class:`artigrasp.assets.fidelity.Fidelity`.
    """

    destination: Path
    written: list[str] = field(default_factory=list)
    unchanged: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    parts: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)


def import_arctic(
    path: Path,
    objects: Iterable[str] | None = None,
    destination: Path | None = None,
    progress: Progress | None = None,
    *,
    mano: Path | None = None,
    processes: int | None = None,
) -> ImportReport:
    """Convert a user's copy of ARCTIC to hands, objects and references.

    Files that were made of the same data before are left alone, and an interrupted import is taken up where it was.

    Args:
        path: The official download, the ArtiGrasp authors' release, or the compact file of labelled frames, or its
            folder, which gives references of objects that were imported before.
        objects: Objects to import; all by default.
        destination: Where to; the import root by default.
        progress: Called before the first product and after each.
        mano: A model file of MANO, or the folder of both, to make the hands of; by default those of the release.
        processes: Largest number of processes that cut meshes; by default as many as there are processors.

    Raises:
        UserError: something is missing or malformed. Files that were finished by then stay.
    """
    source = find_source(path)
    shaped = object_names(source)
    labelled = [] if source.labels is None else labelled_objects(source.labels)
    known = sorted({*shaped, *labelled})
    wanted = known if objects is None else list(dict.fromkeys(objects))
    for name in wanted:
        if name not in known:
            raise unknown("object", name, known)
    if processes is None:
        processes = os.cpu_count() or 1
    elif processes < 1:
        raise UserError(f"expected at least 1 process, found {processes}")
    destination = import_root() if destination is None else destination
    check_folder(destination)
    run = _Import(source, destination, wanted, progress)
    run.make_hands(mano)
    run.make_objects([name for name in wanted if name in shaped], processes)
    run.make_references()
    remove_leftovers(run.report.destination)
    if not run.report.written and not run.report.unchanged:
        raise UserError(f"{path}: nothing can be made of this: {'; '.join(run.report.skipped)}")
    return run.report


class _Import:
    """One import: makes what has changed, and keeps account."""

    def __init__(self, source: ArcticSource, destination: Path, wanted: list[str], progress: Progress | None) -> None:
        self.report = ImportReport(destination)
        self._source, self._wanted, self._progress = source, wanted, progress
        self._manifest = Manifest(destination)
        self._done, self._total = -1, len(HANDS) + 1 + len(wanted) * (len(PARTS) + 2)
        self._step("reading")

    def make_hands(self, mano: Path | None) -> None:
        """Make both hands, and keep their mean pose, if there are files of them."""
        files = {side: find_hand_files(self._source, mano, side) for side in HANDS}
        if not all(files.values()):
            self.report.skipped.append("hands: this copy has none; --mano makes them of MANO's own files")
            return

        def make_hand(side: str, path: Path) -> None:
            hand = read_arctic_hand(files[side], side, path)[0]
            write_hand(replace(hand, skin=draw_skin(hand)))

        def make_mean_pose(path: Path) -> None:
            save_mean_pose(path, {side: read_arctic_hand(files[side], side, path)[1] for side in HANDS})

        for side in HANDS:
            self._make(self._path("hands", f"{HAND_NAME}_{side}"), files[side], partial(make_hand, side))
        self._make(mean_pose_path(self.report.destination), [*files["left"], *files["right"]], make_mean_pose)

    def make_objects(self, names: list[str], processes: int) -> None:
        """Cut the parts of objects into convex pieces, all at once, and make the objects."""
        files = {name: object_files(self._source, name) for name in names}
        changed = [name for name in names if not self._is_made(self._path("objects", name), files[name])]
        read = {name: read_arctic_object(self._source, name) for name in changed}
        cut_meshes(
            {f"{name}: {part}": mesh for name in changed for part, mesh in zip(PARTS, read[name].meshes, strict=True)},
            processes,
            self._step,
        )
        self._done += len(PARTS) * (len(names) - len(changed))

        def make(name: str, path: Path) -> dict[str, Any]:
            base, articulated = (convex_pieces(mesh) for mesh in read[name].meshes)
            write_object(make_object(read[name], (base, articulated), path))
            fits = (measure_fidelity(*each) for each in zip(read[name].meshes, (base, articulated), strict=True))
            return {"parts": {part: asdict(fit) for part, fit in zip(PARTS, fits, strict=True)}}

        for name in names:
            path = self._path("objects", name)
            self._make(path, files[name], partial(make, name))
            noted = self._manifest.note(path, "parts") or {}
            self.report.parts[name] = {part: noted[part] for part in PARTS if part in noted}

    def make_references(self) -> None:
        """Make the references of all wanted objects that are there, from frames that are labelled."""
        mean_pose = mean_pose_path(self.report.destination)

        def make(name: str, path: Path) -> None:
            frames, without = read_labelled_frames(self._source, name)
            self.report.skipped.extend(without)
            model = read_object(self._path("objects", name))
            save_references(path, make_references(model, frames, load_mean_pose(mean_pose)))

        for name in self._wanted:
            path, model = self._path("references", name), self._path("objects", name)
            labels = label_files(self._source, name)
            needed = {"labelled frames": labels, "object": [model], "hands": [mean_pose]}
            if lacking := [what for what, files in needed.items() if not files or not files[0].is_file()]:
                self.report.skipped.append(f"{name}: no references without {' and '.join(lacking)}")
                self._step(name)
                continue
            files = [*labels, *object_sequence_files(self._source, name), model, mean_pose]
            self._make(path, files, partial(make, name))

    def _make(self, path: Path, files: list[Path], make: Callable[[Path], dict[str, Any] | None]) -> None:
        name = path.relative_to(self.report.destination).as_posix()
        if self._is_made(path, files):
            self.report.unchanged.append(name)
        else:
            self._manifest.add(path, self._digest(files), **(make(path) or {}))
            self.report.written.append(name)
        self._step(name)

    def _is_made(self, path: Path, files: list[Path]) -> bool:
        return self._manifest.has(path, self._digest(files))

    def _digest(self, files: list[Path]) -> str:
        return digest_files(files, IMPORTER_VERSION, SETTINGS)

    def _path(self, kind: AssetKind, name: str) -> Path:
        return self.report.destination / kind / f"{name}{SUFFIX[kind]}"

    def _step(self, name: str) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(name, self._done, self._total)
