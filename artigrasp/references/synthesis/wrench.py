"""What contacts with friction can do: hold an object against its weight, or turn its hinge."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from artigrasp.arrays import Array
from artigrasp.references.synthesis.grip import RestingObject
from artigrasp.references.synthesis.surface import FRICTION

EDGES = 6
"""Edges of the pyramid that stands for a friction cone."""
TORQUE_LENGTH = 0.05
"""Distance at which a force's torque counts as much as the force [m]."""
TILT = 0.3
"""Sideways force that a grasp must hold besides the weight, over the weight."""


def holding_error(position: Array, normal: Array, resting: RestingObject) -> float:
    """What of the object's weight contacts cannot hold however they press, over the weight: 0 for a sound grasp.

    The worst of four directions in which the object is also pulled a little sideways.

    Args:
        position: Of C contacts in the base's frame [m], shape (C, 3).
        normal: Unit outward normals of the object there, shape (C, 3).
        resting: The object.
    """
    if not len(position):
        return 1.0
    force = _cone(normal)
    torque = np.cross(position[:, None] - resting.com, force) / TORQUE_LENGTH
    wrenches = np.concatenate([force, torque], axis=2).reshape(-1, 6).T
    first, second = _tangents(resting.up[None])
    errors = []
    for sideways in (first[0], -first[0], second[0], -second[0]):
        wanted = np.concatenate([resting.up + TILT * sideways, np.zeros(3)])
        errors.append(nnls(wrenches, wanted)[1] / np.linalg.norm(wanted))
    return float(max(errors))


def opening_torque(position: Array, normal: Array, resting: RestingObject) -> float:
    """Largest torque that opens the hinge of one of the contacts that presses with a unit force [m], over the lever.

    Args:
        position: Of C contacts with the articulated part in the base's frame [m], shape (C, 3).
        normal: Unit outward normals of the part there, shape (C, 3).
        resting: The object.
    """
    if not len(position):
        return 0.0
    motion, arm = resting.opening_direction(position)
    slant = np.einsum("ni,ni->n", normal, motion)
    along = -slant + FRICTION * np.sqrt(np.maximum(1 - slant**2, 0))
    return float((along * arm).max() / resting.lever)


def _cone(normal: Array) -> Array:
    """Edges of the friction pyramids of contacts, into the object, shape [C, EDGES, 3]."""
    first, second = _tangents(normal)
    turn = np.linspace(0, 2 * np.pi, EDGES, endpoint=False)
    around = np.cos(turn)[:, None] * first[:, None] + np.sin(turn)[:, None] * second[:, None]
    return np.asarray(-normal[:, None] + FRICTION * around)


def _tangents(normal: NDArray[np.floating]) -> tuple[Array, Array]:
    """Two unit vectors across each normal and each other, shape [C, 3]."""
    helper = np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normal, first)
