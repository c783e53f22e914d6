"""The surface of a hand as balls that move with its links.

A hand is the union of its colliders: capsules, and boxes whose edges are rounded as far as they go. A capsule or
rounded box is in turn the union of balls around points of its core, a segment or a rectangle. The distance of these
balls from an object is that of the hand's surface, and they notice that a finger pierces a part thinner than itself.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import Capsule, Collider, HandModel
from artigrasp.kernels.layout import LINK_COUNT

SAG = 5e-4
"""How far the union of balls may lie below the surface that it stands for [m]."""


@dataclass(frozen=True, eq=False)
class HandPoints:
    """P points of a hand, link by link.

    Attributes:
        link: Link of each point, ascending, shape (P,).
        position: In the frame of its link [m], shape (P, 3).
        radius: Of the ball around it [m], shape (P,).
    """

    link: NDArray[np.int32]
    position: Array
    radius: Array


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
    return HandPoints(np.concatenate(links), np.concatenate(positions), np.concatenate(radii))


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
