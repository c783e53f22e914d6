"""ARCTIC's objects: their meshes, masses and hinges, from either layout.

The hinge is the local z axis through the origin: the articulated part turns by the hinge angle about (0, 0, -1).
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from artigrasp.arrays import Array, check_array
from artigrasp.assets.arctic import PART_NAMES, ArcticSource, object_files
from artigrasp.assets.mass import Body, body_of_mesh
from artigrasp.assets.object_model import FARTHEST, PLAIN_COLOURS, Mesh, ObjectModel, PartModel
from artigrasp.assets.urdf import Urdf, read_urdf
from artigrasp.errors import UserError
from artigrasp.kernels.layout import ARTICULATED, PARTS

SIZE = (0.02, 2.0)
"""Between which sizes an object is [m]; another one is in another unit."""
MAX_FACES = 1_000_000


class Hinge(NamedTuple):
    """A hinge's range [rad], damping [N·m·s/rad] and friction [N·m]."""

    lower: float
    upper: float
    damping: float = 0.0
    friction: float = 0.0


HINGES = {
    "espressomachine": Hinge(0.0, 1.5, 0.05, 1e-4),
    "ketchup": Hinge(0.0, 2.5, 0.05, 1e-4),
    "microwave": Hinge(0.0, np.pi, 0.05, 1e-4),
    "phone": Hinge(0.0, 2.5, 0.5, 1.0),
}
"""What the release's URDFs say, for the official download, which has meshes only."""
OTHER_HINGE = Hinge(0.0, np.pi)

DENSITY = 1000.0
"""Of a part whose mass no file gives [kg/m³], as in the release."""
LID_DENSITY = {"box": 250.0, "laptop": 250.0, "mixer": 500.0, "waffleiron": 500.0}
"""Of the articulated parts that the release takes to be thinner than their meshes [kg/m³]."""


@dataclass(frozen=True, eq=False)
class ArcticObject:
    """An object before it is cut into convex pieces.

    Attributes:
        name: Name of the object.
        meshes: Base and articulated part [m].
        bodies: Their masses, where a file gives them.
        hinge: The hinge.
    """

    name: str
    meshes: tuple[Mesh, Mesh]
    bodies: tuple[Body, Body] | None
    hinge: Hinge


def read_arctic_object(source: ArcticSource, name: str) -> ArcticObject:
    """Read an object from the layout that has it.

    Raises:
        UserError: the object is unknown, or a file of it is missing or malformed.
    """
    files = object_files(source, name)
    if files[0].suffix == ".urdf":
        base, articulated = (_read_mesh(path) for path in files[1:])
        urdf = read_urdf(files[0])
        bodies = Body(*urdf.mass(urdf.link(PART_NAMES[0]))), Body(*urdf.mass(urdf.link(PART_NAMES[1])))
        result = ArcticObject(name, (base, articulated), bodies, _read_hinge(urdf))
    else:
        in_mm = tuple(_read_mesh(path) for path in files if path.suffix == ".obj")
        if len(in_mm) == 1:
            in_mm = _split(in_mm[0], files[1])
        base, articulated = (Mesh(mesh.vertices / 1000, mesh.faces) for mesh in in_mm)
        result = ArcticObject(name, (base, articulated), None, HINGES.get(name, OTHER_HINGE))
    size = float(np.ptp(np.concatenate([mesh.vertices for mesh in result.meshes]), axis=0).max())
    if not SIZE[0] < size < SIZE[1]:
        unit = "metres" if files[0].suffix == ".urdf" else "millimetres"
        raise UserError(f"{files[-1]}: expected an object of {SIZE[0]} to {SIZE[1]} m, in {unit}, found {size:.3g} m")
    return result


def make_object(source: ArcticObject, pieces: tuple[tuple[Mesh, ...], tuple[Mesh, ...]], path: Path) -> ObjectModel:
    """The object that is made of these convex pieces, to live at ``path``."""
    base, articulated = (
        PartModel(
            *_body(source, part, pieces[part]),
            mesh.vertices,
            mesh.faces,
            pieces[part],
            np.tile(PLAIN_COLOURS[part], (len(mesh.faces), 1)),
        )
        for part, mesh in enumerate(source.meshes)
    )
    return ObjectModel(
        name=source.name,
        path=path,
        parts=(base, articulated),
        hinge_origin=np.zeros(3),
        hinge_axis=np.array([0.0, 0.0, -1.0]),
        hinge_lower=source.hinge.lower,
        hinge_upper=source.hinge.upper,
        hinge_damping=source.hinge.damping,
        hinge_friction=source.hinge.friction,
    )


def _body(source: ArcticObject, part: int, pieces: tuple[Mesh, ...]) -> Body:
    if source.bodies is not None:
        return source.bodies[part]
    density = LID_DENSITY.get(source.name, DENSITY) if part == ARTICULATED else DENSITY
    return body_of_mesh(source.meshes[part], pieces, density)


def _read_hinge(urdf: Urdf) -> Hinge:
    joint = urdf.joint("rotation")
    axis, origin = urdf.numbers(urdf.child(joint, "axis"), "xyz", 3), urdf.origin(joint)[0]
    if not np.allclose(origin, 0) or not np.allclose(axis, (0, 0, -1)):
        raise urdf.error("joint rotation", f"expected the axis (0, 0, -1) through the origin, found {axis} at {origin}")
    limit, dynamics = urdf.child(joint, "limit"), urdf.child(joint, "dynamics")
    hinge = Hinge(
        urdf.number(limit, "lower"),
        urdf.number(limit, "upper"),
        urdf.number(dynamics, "damping"),
        urdf.number(dynamics, "friction"),
    )
    if not -2 * np.pi <= hinge.lower < hinge.upper <= 2 * np.pi:
        found = f"{hinge.lower:g} and {hinge.upper:g}"
        raise urdf.error("joint rotation limit", f"expected lower < upper within a turn, in radians, found {found}")
    return hinge


def _read_mesh(path: Path) -> Mesh:
    try:
        with path.open("rb") as file:  # not the path: nothing that it refers to is read
            loaded = trimesh.load_mesh(file, file_type="obj", process=False, maintain_order=True)
        mesh = Mesh(np.array(loaded.vertices, float), np.array(loaded.faces, np.int64))
        if not len(mesh.faces):
            raise ValueError("expected triangles, found none")
        if mesh.vertices.shape[1:] != (3,):
            raise ValueError("expected three coordinates of every vertex")
        if not (np.abs(mesh.vertices) < FARTHEST).all() or mesh.faces.min() < 0:
            raise ValueError(f"expected finite vertices nearer than {FARTHEST:g}, and faces of them")
        # Fails for fewer than four points and for those in a plane, of which no solid can be made.
        ConvexHull(mesh.vertices[mesh.faces.ravel()])
    except Exception as error:  # A malformed mesh can fail anywhere in the parser.
        raise UserError(f"{path}: cannot read this mesh: {(str(error) or repr(error)).splitlines()[0]}") from None
    if not len(mesh.faces) <= MAX_FACES:
        raise UserError(f"{path}: expected at most {MAX_FACES} triangles, found {len(mesh.faces)}")
    return mesh


def _split(mesh: Mesh, path: Path) -> tuple[Mesh, Mesh]:
    """Part a mesh of both parts by the number of each vertex; faces between the two parts belong to neither.

    ARCTIC's documentation gives the articulated part the number 1, its own code 0. Its keypoints decide where they are
    there, else the documentation.
    """
    try:
        values = np.array([int(word) for word in re.split(r"[\s,\[\]]+", path.read_text()) if word])
    except (OSError, ValueError):
        values = np.zeros(0, int)
    if values.shape != (len(mesh.vertices),) or set(values.tolist()) != {0, 1}:
        raise UserError(f"{path}: expected 0 or 1 for each of {len(mesh.vertices)} vertices, and both of them")
    keypoints = _read_keypoints(path.with_name("top_keypoints_300.json"))
    if len(keypoints) and values[cKDTree(mesh.vertices).query(keypoints)[1]].mean() < 0.5:
        values = 1 - values
    parts = []
    for part in range(len(PARTS)):
        faces = mesh.faces[(values[mesh.faces] == part).all(axis=1)]
        used, faces = np.unique(faces, return_inverse=True)
        if not len(faces):
            raise UserError(f"{path}: expected faces of the {PART_NAMES[part]} part, found none")
        parts.append(Mesh(mesh.vertices[used], faces.reshape(-1, 3)))
    return parts[0], parts[1]


def _read_keypoints(path: Path) -> Array:
    """Points on the articulated part, in the unit of its mesh, shape (K, 3); none if there is no such file."""
    if not path.is_file():
        return np.zeros((0, 3))
    try:
        return check_array("keypoints", json.loads(path.read_text())["keypoints"], ("K", 3), np.float64)
    except (OSError, ValueError, TypeError, LookupError, RecursionError) as error:
        raise UserError(f'{path}: expected a list of points as "keypoints": {error}') from None
