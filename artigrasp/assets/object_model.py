"""What a hinged object is, in numbers: two rigid parts that share one frame at hinge angle 0."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array

Indices = NDArray[np.int64]
Colour = tuple[float, float, float]
"""Linear RGB, each 0 to 1."""

FARTHEST = 1e4
"""No vertex of a file has a larger coordinate, in whichever unit: sums of squares stay numbers."""
PLAIN_COLOURS: tuple[Colour, Colour] = ((0.36, 0.45, 0.55), (0.90, 0.52, 0.24))
"""Of base and articulated part where a file gives none."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: [m], shape (V, 3).
        faces: Vertex indices, counter-clockwise seen from outside, shape (F, 3).
    """

    vertices: Array
    faces: Indices


def join_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """All meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1]
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
    )


def crossed_edges(triangles: Array) -> Array:
    """Cross products of two edges of triangles (N, 3, 3): along the normals, as long as twice the areas, (N, 3)."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


@dataclass(frozen=True, eq=False)
class PartModel:
    """A rigid part, everything in the object's frame at hinge angle 0.

    Attributes:
        mass: [kg].
        com: Centre of mass [m], shape (3,).
        inertia: About the centre of mass [kg·m²], shape (3, 3).
        vertices: Of the surface that is seen [m], shape (V, 3).
        faces: Of the surface that is seen, shape (F, 3).
        pieces: Convex meshes that together are the part for collisions.
        colours: Linear RGB of each face, each 0 to 1, shape (F, 3).
    """

    mass: float
    com: Array
    inertia: Array
    vertices: Array
    faces: Indices
    pieces: tuple[Mesh, ...]
    colours: Array

    @property
    def colour(self) -> Colour:
        """Linear RGB of most of the surface, for where one colour has to do."""
        corners = self.vertices[self.faces]
        areas = np.linalg.norm(crossed_edges(corners), axis=1)
        palette, index = np.unique(self.colours, axis=0, return_inverse=True)
        red, green, blue = palette[np.bincount(index.ravel(), areas).argmax()].tolist()
        return red, green, blue


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """A hinged object.

    At hinge angle ω the articulated part's frame is base ∘ T(hinge_origin) ∘ Rot(hinge_axis, ω) ∘ T(−hinge_origin).

    Attributes:
        name: Name of the object.
        path: The USD file of this object.
        parts: Base and articulated part, in the order of ``PARTS``.
        hinge_origin: A point of the hinge's axis [m], shape (3,).
        hinge_axis: Unit direction of the hinge's axis, shape (3,); turning positively about it opens.
        hinge_lower: Smallest angle [rad].
        hinge_upper: Largest angle [rad].
        hinge_damping: [N·m·s/rad].
        hinge_friction: [N·m].
    """

    name: str
    path: Path
    parts: tuple[PartModel, PartModel]
    hinge_origin: Array
    hinge_axis: Array
    hinge_lower: float
    hinge_upper: float
    hinge_damping: float
    hinge_friction: float

    def articulated_pose_in_base(self, angle: float) -> tuple[Array, Array]:
        """Position [m] and orientation (xyzw) of the articulated part's frame in the base's at a hinge angle [rad]."""
        turn = Rotation.from_rotvec(angle * self.hinge_axis)
        return self.hinge_origin - turn.apply(self.hinge_origin), turn.as_quat()

    def vertices_in_base(self, angle: float) -> Array:
        """The vertices of both parts in the base's frame at a hinge angle [rad], shape (V, 3) [m]."""
        position, orientation = self.articulated_pose_in_base(angle)
        base, articulated = self.parts
        return np.concatenate([base.vertices, Rotation.from_quat(orientation).apply(articulated.vertices) + position])
