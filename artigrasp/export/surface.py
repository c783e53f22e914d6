"""The triangle surfaces that pictures and USD files show."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import Capsule, Collider, HandModel
from artigrasp.assets.object import PartModel

BALL_SUBDIVISIONS = 3
"""How finely round surfaces are divided."""
CREASE = np.radians(35.0)
"""Faces that meet at a larger angle have a visible edge between them [rad]."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh with shading normals.

    Attributes:
        vertices: Positions [m], shape ``[V, 3]``.
        faces: Vertex indices, counter-clockwise seen from outside, shape ``[F, 3]``.
        corner_normals: Unit normal at each corner of each face, shape ``[F, 3, 3]``.
    """

    vertices: Array
    faces: NDArray[np.int32]
    corner_normals: Array


def mesh_surface(vertices: Array, faces: NDArray[np.integer]) -> Surface:
    """Give a mesh normals that are smooth across faces, but for creases."""
    return _surface(*_solid_faces(vertices, faces))


def part_surface(part: PartModel) -> tuple[Surface, Array]:
    """The surface of an object's part, and linear RGB of each of its faces, shape ``[F, 3]``."""
    mesh, kept = _solid_faces(part.vertices, part.faces)
    return _surface(mesh, kept), part.colours[kept]


def link_surface(hand: HandModel, link: int) -> Surface:
    """The surface of a hand link in its frame: its colliders, boxes rounded as far as they go."""
    return join([_collider_surface(collider) for collider in hand.colliders[link]])


def join(surfaces: Sequence[Surface]) -> Surface:
    """All surfaces as one."""
    first_vertex = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])[:-1]
    return Surface(
        np.concatenate([surface.vertices for surface in surfaces]),
        np.concatenate([surface.faces + first for surface, first in zip(surfaces, first_vertex, strict=True)]),
        np.concatenate([surface.corner_normals for surface in surfaces]),
    )


def place(surface: Surface, pose: NDArray[np.floating]) -> Surface:
    """The surface moved from its own frame to where that frame's pose (position [m], quaternion xyzw) is given."""
    turn = Rotation.from_quat(pose[3:])
    normals = turn.apply(surface.corner_normals.reshape(-1, 3)).reshape(-1, 3, 3)
    return Surface(turn.apply(surface.vertices) + pose[:3], surface.faces, normals)


def rest(surface: Surface) -> Surface:
    """The surface moved up or down until its lowest point is at z = 0."""
    lowest = np.array([0.0, 0.0, surface.vertices[:, 2].min()])
    return Surface(surface.vertices - lowest, surface.faces, surface.corner_normals)


def _solid_faces(vertices: Array, faces: NDArray[np.integer]) -> tuple[trimesh.Trimesh, NDArray[np.bool_]]:
    """A mesh in which vertices at the same place are one, and which of its faces have an area."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return mesh, mesh.nondegenerate_faces()


def _surface(mesh: trimesh.Trimesh, kept: NDArray[np.bool_]) -> Surface:
    mesh.update_faces(kept)
    return Surface(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32), _corner_normals(mesh))


def _collider_surface(collider: Collider) -> Surface:
    """A capsule or a rounded box: the hull of balls at the ends of the one or the inner corners of the other."""
    if isinstance(collider, Capsule):
        radius = collider.radius
        reach = np.array([0.0, 0.0, collider.length / 2])
    else:
        radius = collider.extents.min() / 2
        reach = collider.extents / 2 - radius
    ball = trimesh.creation.icosphere(subdivisions=BALL_SUBDIVISIONS, radius=radius).vertices
    centers = np.unique(np.array(list(itertools.product((-1, 1), repeat=3))) * reach, axis=0)
    hull = trimesh.Trimesh((centers[:, None] + ball).reshape(-1, 3)).convex_hull
    turn = Rotation.from_quat(collider.orientation)
    return mesh_surface(turn.apply(hull.vertices) + collider.position, hull.faces)


def _corner_normals(mesh: trimesh.Trimesh) -> Array:
    """At each corner, the mean normal of the faces around the vertex that meet its face without a crease."""
    order = np.argsort(mesh.faces, axis=None, kind="stable")
    vertex = mesh.faces.ravel()[order]
    first, count = (np.searchsorted(vertex, np.arange(len(mesh.vertices)), side) for side in ("left", "right"))
    count = count - first
    # All pairs of a corner and a face around its vertex, corner by corner.
    corner = np.repeat(order, count[vertex])
    around = np.arange(len(corner)) - np.repeat(np.cumsum(count[vertex]) - count[vertex], count[vertex])
    face = order[np.repeat(first[vertex], count[vertex]) + around] // 3
    normal = mesh.face_normals
    smooth = np.einsum("ij,ij->i", normal[corner // 3], normal[face]) > np.cos(CREASE)
    total = np.zeros((3 * len(mesh.faces), 3))
    np.add.at(total, corner[smooth], (normal * mesh.area_faces[:, None])[face[smooth]])
    total /= np.linalg.norm(total, axis=1, keepdims=True)
    return total.reshape(-1, 3, 3)
