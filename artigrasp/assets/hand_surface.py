"""The surface of a hand as points that move with its links.

A hand is the union of its colliders: capsules, and boxes whose edges are rounded as far as they go. A capsule or
rounded box is in turn the union of balls around points of its core, a segment or a rectangle. That gives two samplings:

* :func:`core_points`, few balls, whose distance from an object is that of the hand's surface, and which notice that a
  finger pierces a part thinner than itself;
* :func:`skin_points`, many points with outward normals.
"""

import itertools
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import Capsule, Collider, HandModel
from artigrasp.kernels.layout import LINK_COUNT

Array = NDArray[np.float64]

SAG = 5e-4
"""How far the union of balls may lie below the surface that it stands for [m]."""
DIRECTION_SUBDIVISIONS = 1
"""How finely the directions are divided in which a ball has skin: 42 of them."""


@dataclass(frozen=True, eq=False)
class HandPoints:
    """P points of a hand, link by link.

    Attributes:
        link: Link of each point, ascending, shape (P,).
        position: In the frame of its link [m], shape (P, 3).
        radius: Of the ball around it, zero for a point of the skin [m], shape (P,).
        normal: Unit outward normal of a point of the skin in the frame of its link, zero for a ball, shape (P, 3).
    """

    link: NDArray[np.int32]
    position: Array
    radius: Array
    normal: Array


def core_points(hand: HandModel, sag: float = SAG) -> HandPoints:
    """Balls whose union is the hand; where it lies below the surface, it is by no more than ``sag`` [m]."""
    positions, radii, links = [], [], []
    for link in range(LINK_COUNT):
        for collider in hand.colliders[link]:
            reach, radius = _core(collider)
            local = _grid(reach, radius, sag)
            positions.append(Rotation.from_quat(collider.orientation).apply(local) + collider.position)
            radii.append(np.full(len(local), radius))
            links.append(np.full(len(local), link, np.int32))
    position = np.concatenate(positions)
    return HandPoints(np.concatenate(links), position, np.concatenate(radii), np.zeros_like(position))


def skin_points(hand: HandModel) -> HandPoints:
    """Points of the surface of every link, without those that are inside another collider of the link."""
    core = core_points(hand)
    directions = trimesh.creation.icosphere(subdivisions=DIRECTION_SUBDIVISIONS).vertices
    positions, normals, links = [], [], []
    for link in range(LINK_COUNT):
        of_link = core.link == link
        centre, radius = core.position[of_link], core.radius[of_link]
        normal = np.tile(directions, (len(centre), 1))
        position = np.repeat(centre, len(directions), axis=0) + np.repeat(radius, len(directions))[:, None] * normal
        depth = radius - np.linalg.norm(position[:, None] - centre, axis=-1)
        outside = depth.max(axis=1) < 1e-9
        positions.append(position[outside])
        normals.append(normal[outside])
        links.append(np.full(outside.sum(), link, np.int32))
    position = np.concatenate(positions)
    return HandPoints(np.concatenate(links), position, np.zeros(len(position)), np.concatenate(normals))


def _core(collider: Collider) -> tuple[Array, float]:
    """Half the extents of the core in the collider's frame, and the radius of the balls around its points [m]."""
    if isinstance(collider, Capsule):
        return np.array([0.0, 0.0, collider.length / 2]), collider.radius
    radius = float(collider.extents.min()) / 2
    return collider.extents / 2 - radius, radius


def _grid(reach: Array, radius: float, sag: float) -> Array:
    """Points of a core, so close that balls around them leave no more than ``sag`` between them, shape (N, 3)."""
    extended = reach > 1e-9
    spacing = 2 * np.sqrt(max(2 * radius * sag - sag**2, sag**2) / max(extended.sum(), 1))
    axes = [
        np.linspace(-half, half, int(np.ceil(2 * half / spacing)) + 1) if long else np.zeros(1)
        for half, long in zip(reach, extended, strict=True)
    ]
    return np.array(list(itertools.product(*axes)))
