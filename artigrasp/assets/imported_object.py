"""A hinged object of somebody else's, whatever file it came from, and what becomes of it here."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh
from scipy.spatial import QhullError
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import Array
from artigrasp.assets.check import MAX_PIECE_VERTICES
from artigrasp.assets.cutting import cut_meshes
from artigrasp.assets.decomposition import convex_pieces
from artigrasp.assets.mass import Body, body_of_mesh
from artigrasp.assets.object_model import PLAIN_COLOURS, Colour, Mesh, ObjectModel, PartModel, join_meshes
from artigrasp.errors import UserError

MESHES = (".obj", ".stl", ".ply", ".glb")
"""Suffixes of mesh files."""
CONVEX = 0.995
"""A mesh that fills so much of its hull is one convex piece as it is."""


@dataclass(frozen=True, eq=False)
class ImportedPart:
    """A part in the frame of the base, the hinge closed.

    Attributes:
        shown: Meshes that are seen, and linear RGB of each, None where the file gives none.
        solid: Meshes that collide; none where those that are seen do.
        body: Mass, centre and inertia, None where the file gives none.
    """

    shown: tuple[tuple[Mesh, Colour | None], ...]
    solid: tuple[Mesh, ...]
    body: Body | None


@dataclass(frozen=True, eq=False)
class ImportedObject:
    """A hinged object as a file describes it.

    Attributes:
        path: The file.
        parts: Base and articulated part.
        hinge_origin: A point of the axis, in the frame of the base [m].
        hinge_axis: Unit direction; turning positively about it opens.
        hinge_upper: Largest angle [rad]; closed is 0.
        hinge_damping: [N·m·s/rad].
        hinge_friction: [N·m].
    """

    path: Path
    parts: tuple[ImportedPart, ImportedPart]
    hinge_origin: Array
    hinge_axis: Array
    hinge_upper: float
    hinge_damping: float
    hinge_friction: float


def closed_angle(lower: float, upper: float) -> tuple[float, Literal[-1, 1]]:
    """Which angle of a joint's range [rad] is the closed object, and the sign of turning from there that opens it.

    Closed is the limit that is nearer to 0, as most files are authored.
    """
    return (lower, 1) if abs(lower) <= abs(upper) else (upper, -1)


def make_imported(
    source: ImportedObject,
    name: str,
    path: Path,
    *,
    density: float = 500.0,
    progress: Callable[[str, int, int], None] | None = None,
) -> ObjectModel:
    """The object in our terms, to live at ``path``; it stands on z = 0 with its middle above the origin.

    Args:
        source: What a file describes.
        name: What to call it.
        path: Of the object.
        density: Of parts whose mass the file does not give [kg/m³].
        progress: Called before each part is cut into convex pieces, with what is done, how many are, and of how many.

    Raises:
        UserError: A part is flat, or cannot be cut.
    """
    seen = np.concatenate([mesh.vertices for part in source.parts for mesh, _ in part.shown])
    low, high = seen.min(axis=0), seen.max(axis=0)
    shift = RigidTransform.from_translation([-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]])
    parts = []
    for index, part in enumerate(source.parts):
        where = f"{source.path}: part {index + 1}"
        if progress is not None:
            progress(f"part {index + 1}", index, 2)
        try:
            parts.append(_make_part(part, shift, density, PLAIN_COLOURS[index], where))
        except (QhullError, ValueError) as error:
            problem = str(error).splitlines()[0]
            raise UserError(f"{where}: expected a shape with a volume: {problem}") from None
    return ObjectModel(
        name=name,
        path=path,
        parts=(parts[0], parts[1]),
        hinge_origin=shift.apply(source.hinge_origin),
        hinge_axis=source.hinge_axis,
        hinge_lower=0.0,
        hinge_upper=source.hinge_upper,
        hinge_damping=source.hinge_damping,
        hinge_friction=source.hinge_friction,
    )


def moved(mesh: Mesh, pose: RigidTransform) -> Mesh:
    """A mesh in another frame, in which its own has this pose."""
    return Mesh(pose.apply(mesh.vertices), mesh.faces)


def moved_body(body: Body, pose: RigidTransform) -> Body:
    """A body in another frame, in which its own has this pose."""
    turn = pose.rotation.as_matrix()
    return Body(body.mass, pose.apply(body.com), turn @ body.inertia @ turn.T)


def revolute_pose(origin: Array, axis: Array, angle: float) -> RigidTransform:
    """Turning by an angle [rad] about an axis through a point [m]."""
    turn = Rotation.from_rotvec(angle * axis)
    return RigidTransform.from_components(origin - turn.apply(origin), turn)


def load_mesh(path: Path, scale: Array) -> Mesh:
    """Read a mesh file, and no other file that it refers to.

    Raises:
        UserError: it is missing, of an unknown kind or not a mesh.
    """
    if not path.is_file():
        raise UserError(f"{path}: expected a mesh, found nothing")
    if path.suffix.lower() not in MESHES:
        raise UserError(
            f"{path}: cannot read this mesh: expected {', '.join(MESHES)}, found {path.suffix or 'no'} file"
        )
    try:
        with path.open("rb") as file:
            loaded = trimesh.load_mesh(file, file_type=path.suffix[1:].lower(), process=False, force="mesh")
        mesh = trimesh.Trimesh(np.array(loaded.vertices, float) * scale, np.array(loaded.faces), process=False)
        # Files repeat a vertex for every normal and texture coordinate: that tears the surface apart.
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        if scale.prod() < 0:
            mesh.invert()
        if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
            raise ValueError("expected triangles, found none")
    except Exception as error:  # A malformed mesh can fail anywhere in the parser.
        raise UserError(f"{path}: cannot read this mesh: {(str(error) or repr(error)).splitlines()[0]}") from None
    return mesh_of(mesh)


def mesh_of(solid: trimesh.Trimesh) -> Mesh:
    """The vertices and faces of a solid."""
    return Mesh(np.array(solid.vertices), np.array(solid.faces, np.int64))


def _make_part(part: ImportedPart, shift: RigidTransform, density: float, colour: Colour, where: str) -> PartModel:
    shown = [moved(mesh, shift) for mesh, _ in part.shown]
    whole = join_meshes(shown)
    solid = [moved(mesh, shift) for mesh in part.solid] or shown
    with np.errstate(invalid="ignore"):  # what has no volume has no middle
        pieces = tuple(piece for mesh in solid for piece in _pieces(mesh, where))
        body = body_of_mesh(whole, pieces, density) if part.body is None else moved_body(part.body, shift)
    if not (body.mass > 0 and np.isfinite(body.com).all() and np.isfinite(body.inertia).all()):
        raise ValueError(f"its mass is {body.mass:g} kg")
    colours = [np.tile(own or colour, (len(mesh.faces), 1)) for mesh, own in part.shown]
    return PartModel(*body, whole.vertices, whole.faces, pieces, np.concatenate(colours))


def _pieces(mesh: Mesh, where: str) -> Sequence[Mesh]:
    """A mesh as it is if it is convex and small, else cut into convex pieces, in a process that it may break."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    hull = trimesh.convex.convex_hull(mesh.vertices)
    if len(hull.vertices) <= MAX_PIECE_VERTICES and abs(solid.volume) > CONVEX * hull.volume:
        return (mesh_of(hull),)
    cut_meshes({where: mesh}, processes=1, progress=lambda name: None)
    return convex_pieces(mesh)
