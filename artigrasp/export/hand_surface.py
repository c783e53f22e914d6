"""How a hand looks: as its rigid links, or in a skin without gaps that bends with them."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import trimesh
import warp as wp
import warp.geometry
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import Capsule, Collider, HandModel
from artigrasp.export.surface import Surface, join, link_surface, place
from artigrasp.kernels.layout import FINGERS, LINK_COUNT, LINK_PARENTS

Array = NDArray[np.float64]

CELL = 0.002
"""Edge length of the cells in which the surface is sought [m]."""
BLEND = 0.008
"""Over which distance neighbouring links of a finger melt into each other [m]."""
CREASE_BLEND = 0.003
"""The same for neighbouring fingers [m]."""
BEND = 0.004
"""How fast a link loses hold of the skin with the distance from it [m]."""
ROUNDS = 8
"""Of smoothing, which takes the steps of the cells away."""


class HandSurface(Protocol):
    """What a hand looks like, wherever its links are."""

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """The surface of links at these poses (position [m], quaternion xyzw), shape ``[16, 7]``."""

    def of_faces(self, of_links: Array) -> Array:
        """What the faces have of something that the links have, shape ``[16, ...]`` to ``[F, ...]``."""


def hand_surface(hand: HandModel, *, rigid: bool = False) -> HandSurface:
    """A hand in its skin, or as the rigid links that collide."""
    return Links(tuple(link_surface(hand, link) for link in range(LINK_COUNT))) if rigid else make_skin(hand)


@dataclass(frozen=True, eq=False)
class Links:
    """The rigid links of a hand, each with the surface of its collision shapes in its own frame."""

    surfaces: tuple[Surface, ...]

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """See :meth:`HandSurface.posed`."""
        return join([place(surface, pose) for surface, pose in zip(self.surfaces, link_poses, strict=True)])

    def of_faces(self, of_links: Array) -> Array:
        """See :meth:`HandSurface.of_faces`."""
        return np.repeat(of_links, [len(surface.faces) for surface in self.surfaces], axis=0)


@dataclass(frozen=True, eq=False)
class Skin:
    """A surface that follows the links of a hand.

    Attributes:
        vertices: In the hand's zero pose, in the frame of the wrist link [m], shape ``[V, 3]``.
        normals: Unit normals of the vertices there, shape ``[V, 3]``.
        faces: Vertex indices, counter-clockwise seen from outside, shape ``[F, 3]``.
        weights: How much of each link's motion a vertex takes part in, shape ``[V, 16]``; they add up to 1.
        link_origin: Origins of the links in the zero pose [m], shape ``[16, 3]``.
    """

    vertices: Array
    normals: Array
    faces: NDArray[np.int32]
    weights: Array
    link_origin: Array

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """See :meth:`HandSurface.posed`."""
        turns = Rotation.from_quat(link_poses[:, 3:]).as_matrix()
        moves = link_poses[:, :3] - np.einsum("lij,lj->li", turns, self.link_origin)
        turn = np.einsum("vl,lij->vij", self.weights, turns)
        vertices = np.einsum("vij,vj->vi", turn, self.vertices) + self.weights @ moves
        normals = np.einsum("vij,vj->vi", turn, self.normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Surface(vertices, self.faces, normals[self.faces])

    def of_faces(self, of_links: Array) -> Array:
        """See :meth:`HandSurface.of_faces`."""
        found: Array = (self.weights @ of_links)[self.faces].mean(axis=1)
        return found


def make_skin(hand: HandModel) -> Skin:
    """Draw a skin around a hand's collision shapes: the fingers melt into the palm, and hardly into each other."""
    origins = np.zeros((LINK_COUNT, 3))
    for link in range(1, LINK_COUNT):
        origins[link] = origins[LINK_PARENTS[link]] + hand.link_offset[link]
    bounds = np.array(
        [
            origin + collider.position + sign * (_size(collider) + BLEND)
            for origin, colliders in zip(origins, hand.colliders, strict=True)
            for collider in colliders
            for sign in (-1, 1)
        ]
    )
    low, high = bounds.min(axis=0), bounds.max(axis=0)
    axes = [np.arange(start, stop + CELL, CELL) for start, stop in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = _blended(_link_distances(hand, origins, grid.reshape(-1, 3))).reshape(grid.shape[:3])
    corners, indices = wp.geometry.IsoSurfaceMarchingCubes.extract(
        wp.array(distance.astype(np.float32), dtype=float, device="cpu"),
        threshold=0.0,
        lower=wp.vec3(*grid[0, 0, 0]),
        upper=wp.vec3(*grid[-1, -1, -1]),
    )
    mesh = trimesh.Trimesh(corners.numpy(), indices.numpy().reshape(-1, 3))
    smooth: Any = trimesh.smoothing.filter_taubin
    smooth(mesh, iterations=ROUNDS)
    if mesh.volume < 0:
        mesh.invert()
    vertices = np.asarray(mesh.vertices, float)
    return Skin(
        vertices=vertices,
        normals=np.array(mesh.vertex_normals),
        faces=np.array(mesh.faces, np.int32),
        weights=_weights(_link_distances(hand, origins, vertices)),
        link_origin=origins,
    )


def _link_distances(hand: HandModel, origins: Array, points: Array) -> Array:
    """Distances of points from the surfaces of all links, negative inside [m], shape ``[16, N]``."""
    return np.stack(
        [
            np.min([_distance(collider, points - origin) for collider in colliders], axis=0)
            for origin, colliders in zip(origins, hand.colliders, strict=True)
        ]
    )


def _distance(collider: Collider, points: Array) -> Array:
    """Distance of points in the link's frame from a capsule, or from a box as round as it can be."""
    local = Rotation.from_quat(collider.orientation).inv().apply(points - collider.position)
    if isinstance(collider, Capsule):
        radius, core = collider.radius, np.array([0.0, 0.0, collider.length / 2])
    else:
        radius = float(collider.extents.min()) / 2
        core = collider.extents / 2 - radius
    distance: Array = np.linalg.norm(np.maximum(np.abs(local) - core, 0.0), axis=1) - radius
    return distance


def _blended(distances: Array) -> Array:
    """Distance from the whole skin, of distances from the links."""
    fingers = distances[1:].reshape(len(FINGERS), 3, -1)
    whole: Array | None = None
    for first, second, third in fingers:
        finger = _melt(_melt(_melt(distances[0], first, BLEND), second, BLEND), third, BLEND)
        whole = finger if whole is None else _melt(whole, finger, CREASE_BLEND)
    assert whole is not None
    return whole


def _melt(a: Array, b: Array, width: float) -> Array:
    """The smaller of two distances, rounded where they are about equal."""
    overlap = np.maximum(width - np.abs(a - b), 0.0)
    melted: Array = np.minimum(a, b) - overlap**2 / (4 * width)
    return melted


def _weights(distances: Array) -> Array:
    """How much the nearest link of a vertex, its parent and its children hold it, shape ``[V, 16]``."""
    nearest = distances.argmin(axis=0)
    related = np.eye(LINK_COUNT, dtype=bool)
    for link in range(1, LINK_COUNT):
        related[link, LINK_PARENTS[link]] = related[LINK_PARENTS[link], link] = True
    hold = np.exp(-(distances - distances.min(axis=0)) / BEND).T * related[nearest]
    weights: Array = hold / hold.sum(axis=1, keepdims=True)
    return weights


def _size(collider: Collider) -> Array:
    """How far a shape reaches from its centre along the axes of its link [m], shape ``[3]``."""
    axes = np.abs(Rotation.from_quat(collider.orientation).as_matrix())
    if isinstance(collider, Capsule):
        reach: Array = axes[:, 2] * collider.length / 2 + collider.radius
    else:
        reach = axes @ collider.extents / 2
    return reach
