"""Where things are in a user's copy of ARCTIC, whichever layout it has.

The data is licensed to each user: what is made of it stays with the user and is never shipped.
"""

from dataclasses import dataclass
from pathlib import Path

from artigrasp.errors import UserError, unknown

HAND_NAME = "mano"
"""Name of the hands of the mean shape."""
PART_NAMES = ("bottom", "top")
"""ARCTIC's names of the parts, in the order of ``PARTS``."""
LABELS = "labelled_frames.npz"
"""Name of the compact file of all labelled frames."""
DOWNLOAD_ROOTS = ("", "data", "arctic_data/data")
"""Where the official download's folders may be below the folder that a user names."""


@dataclass(frozen=True)
class ArcticSource:
    """What a folder has of ARCTIC; at least one of the three.

    Attributes:
        path: The folder or file that the user named.
        release: The ArtiGrasp authors' release: the folder that holds ``arctic/`` and ``mano_double/``.
        download: The official download: the folder that holds ``meta/`` and ``raw_seqs/``.
        labels: The compact file of labelled frames.
    """

    path: Path
    release: Path | None
    download: Path | None
    labels: Path | None


def find_source(path: Path) -> ArcticSource:
    """Recognise what a user's folder, or a single file of labelled frames, has of ARCTIC.

    Raises:
        UserError: none of the known layouts is there.
    """
    if path.is_file():
        return ArcticSource(path, None, None, path)
    release = next((root for root in (path / "rsc", path) if (root / "arctic").is_dir()), None)
    roots = (path / root for root in DOWNLOAD_ROOTS)
    download = next((root for root in roots if (root / "meta" / "object_vtemplates").is_dir()), None)
    labels = path / LABELS if (path / LABELS).is_file() else None
    source = ArcticSource(path, release, download, labels)
    if labels is None and not object_names(source):
        raise UserError(
            f"{path}: expected ARCTIC as rsc/arctic/<object>/<object>.urdf, as meta/object_vtemplates/<object>/ or as "
            f"{LABELS}, found {'none of them' if path.is_dir() else 'nothing'}"
        )
    return source


def object_names(source: ArcticSource) -> list[str]:
    """The objects whose shape is there, sorted."""
    names: set[str] = set()
    if source.release is not None:
        names |= {path.stem for path in source.release.glob("arctic/*/*.urdf") if path.stem == path.parent.name}
    if source.download is not None:
        templates = source.download.glob("meta/object_vtemplates/*/*.obj")
        names |= {path.parent.name for path in templates if path.name in ("mesh.obj", "top.obj")}
    return sorted(names)


def object_files(source: ArcticSource, name: str) -> list[Path]:
    """The files that an object is made of: its URDF and the meshes of its parts, base first, or only the latter.

    The last of the layouts is one mesh of both parts, and which vertex belongs to which of them.

    Raises:
        UserError: the object is unknown or incomplete.
    """
    if name not in (names := object_names(source)):
        raise unknown("object", name, names)
    files: list[Path] = []
    if source.release is not None and (folder := source.release / "arctic" / name).is_dir():
        files = [folder / f"{name}.urdf", *(folder / f"{part}_watertight_tiny.obj" for part in PART_NAMES)]
    elif source.download is not None:
        folder = source.download / "meta" / "object_vtemplates" / name
        files = [folder / f"{part}.obj" for part in PART_NAMES]
        if not all(path.is_file() for path in files):
            files = [folder / "mesh.obj", folder / "parts.json"]
    for path in files:
        if not path.is_file():
            raise UserError(f"{path}: expected a file of the object {name!r}, found nothing")
    return files


def hand_files(source: ArcticSource, side: str) -> list[Path]:
    """The URDF of a hand and its mean pose; empty where the layout has no hands."""
    if source.release is None:
        return []
    folder = source.release / "mano_double"
    files = [folder / f"{side[0]}hand_mano.urdf", folder / f"{side}_pose_mean.txt"]
    for path in files:
        if not path.is_file():
            raise UserError(f"{path}: expected a file of the {side} hand, found nothing")
    return files
