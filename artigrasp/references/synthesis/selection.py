"""Which synthesised grips are sound, and a few of them that differ."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array

POSITION_SCALE, TURN_SCALE = 0.03, 0.5
"""Distance [m] and angle [rad] between wrists that count as a difference of one."""
CONTACT_SCALE = 0.5
"""Share of contacts that two grips do not have in common that counts as a difference of one."""
LEAST_DIFFERENCE = 0.5
"""Grips that differ less are the same."""


@dataclass(frozen=True, eq=False)
class Descriptors:
    """What tells N grips of H hands apart.

    Attributes:
        wrist: Wrist poses in the base's frame: position [m], quaternion xyzw, shape (N, H, 7).
        contacts: Links that touch, shape (N, H, 16).
    """

    wrist: Array
    contacts: NDArray[np.bool_]

    def differences(self, row: int, others: NDArray[np.integer]) -> Array:
        """How much one grip differs from others, shape [len(others)]: the mean over hands."""
        offset = np.linalg.norm(self.wrist[others, :, :3] - self.wrist[row, :, :3], axis=2) / POSITION_SCALE
        shape = offset.shape
        one = Rotation.from_quat(np.broadcast_to(self.wrist[row, :, 3:], (*shape, 4)).reshape(-1, 4))
        other = Rotation.from_quat(self.wrist[others, :, 3:].reshape(-1, 4))
        turn = (one.inv() * other).magnitude().reshape(shape) / TURN_SCALE
        common = (self.contacts[others] & self.contacts[row]).sum(axis=2)
        either = (self.contacts[others] | self.contacts[row]).sum(axis=2)
        apart = (1 - common / np.maximum(either, 1)) / CONTACT_SCALE
        return np.asarray(np.sqrt(offset**2 + turn**2 + apart**2).mean(axis=1))


def choose_different(
    descriptors: Descriptors, cost: Array, eligible: NDArray[np.bool_], count: int
) -> NDArray[np.int64]:
    """Rows of grips that differ: first the cheapest one, then always the one that differs most from those chosen.

    Args:
        descriptors: What tells N grips apart.
        cost: The lower the better; half the eligible grips that cost most are chosen only where others are alike,
            shape (N,).
        eligible: Which may be chosen, shape (N,).
        count: Most that are chosen.
    """
    rows = np.flatnonzero(eligible)
    if not len(rows):
        return rows
    chosen = [int(rows[cost[rows].argmin()])]
    nearest = descriptors.differences(chosen[0], rows)
    dear = cost[rows] > np.median(cost[rows])
    while len(chosen) < count and nearest.max() >= LEAST_DIFFERENCE:
        merit = np.where(dear, 0.5, 1.0) * nearest
        pick = int(np.where(nearest >= LEAST_DIFFERENCE, merit, -np.inf).argmax())
        chosen.append(int(rows[pick]))
        nearest = np.minimum(nearest, descriptors.differences(chosen[-1], rows))
    return np.array(chosen, np.int64)
