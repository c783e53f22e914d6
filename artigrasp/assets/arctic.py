"""Hands and objects of the ArtiGrasp authors' release of ARCTIC, converted to USD.

The data is licensed to each user: what is made of it stays with the user and is never shipped.
"""

from pathlib import Path

import numpy as np
import trimesh

from artigrasp.assets.decomposition import convex_pieces
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import Mesh, ObjectModel, PartModel
from artigrasp.assets.urdf import Urdf, read_urdf
from artigrasp.assets.urdf_hand import read_urdf_hand
from artigrasp.errors import UserError

HAND_NAME = "mano"
PART_LINKS = ("bottom", "top")
"""The release's names of the parts, in the order of ``PARTS``."""
COLOURS = ((0.36, 0.45, 0.55), (0.90, 0.52, 0.24))


def hand_urdf(release: Path, side: str) -> Path:
    """The URDF of a hand in the release."""
    return release / "rsc" / "mano_double" / f"{side[0]}hand_mano.urdf"


def object_folder(release: Path, name: str) -> Path:
    """The folder of an object in the release."""
    return release / "rsc" / "arctic" / name


def object_names(release: Path) -> list[str]:
    """The objects that the release has, sorted.

    Raises:
        UserError: this is not the release's layout.
    """
    names = sorted(path.parent.name for path in object_folder(release, "").glob("*/*.urdf") if _names_folder(path))
    if not names:
        raise UserError(f"{release}: expected a folder with rsc/arctic/<object>/<object>.urdf, found no object")
    return names


def object_sources(release: Path, name: str) -> list[Path]:
    """The files that an object is made of."""
    folder = object_folder(release, name)
    return [folder / f"{name}.urdf", *(folder / f"{link}_watertight_tiny.obj" for link in PART_LINKS)]


def convert_hand(release: Path, side: str, path: Path) -> HandModel:
    """The release's hand of the mean shape, to live at ``path``."""
    return read_urdf_hand(hand_urdf(release, side), HAND_NAME, side, path)


def convert_object(release: Path, name: str, path: Path) -> ObjectModel:
    """An object of the release, to live at ``path``.

    Raises:
        UserError: a file of the object is missing or malformed.
    """
    urdf_path, *mesh_paths = object_sources(release, name)
    urdf = read_urdf(urdf_path)
    hinge = urdf.joint("rotation")
    limit, dynamics = urdf.child(hinge, "limit"), urdf.child(hinge, "dynamics")
    base, articulated = (
        _convert_part(urdf, link, mesh_path, colour)
        for link, mesh_path, colour in zip(PART_LINKS, mesh_paths, COLOURS, strict=True)
    )
    axis = urdf.numbers(urdf.child(hinge, "axis"), "xyz", 3)
    return ObjectModel(
        name=name,
        path=path,
        parts=(base, articulated),
        hinge_origin=urdf.origin(hinge)[0],
        hinge_axis=axis / np.linalg.norm(axis),
        hinge_lower=urdf.number(limit, "lower"),
        hinge_upper=urdf.number(limit, "upper"),
        hinge_damping=urdf.number(dynamics, "damping"),
        hinge_friction=urdf.number(dynamics, "friction"),
    )


def _convert_part(urdf: Urdf, link: str, mesh_path: Path, colour: tuple[float, float, float]) -> PartModel:
    mass, com, inertia = urdf.mass(urdf.link(link))
    mesh = _read_mesh(mesh_path)
    return PartModel(mass, com, inertia, mesh.vertices, mesh.faces, convex_pieces(mesh), colour)


def _read_mesh(path: Path) -> Mesh:
    try:
        loaded = trimesh.load_mesh(path, process=False)
        mesh = Mesh(np.array(loaded.vertices, float), np.array(loaded.faces, np.int64))
    except FileNotFoundError:
        raise UserError(f"{path}: expected a mesh, found nothing") from None
    except Exception as error:  # A malformed mesh can fail anywhere in the parser.
        raise UserError(f"{path}: cannot read this mesh: {(str(error) or repr(error)).splitlines()[0]}") from error
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UserError(f"{path}: expected a mesh of finite triangles")
    return mesh


def _names_folder(path: Path) -> bool:
    return path.stem == path.parent.name
