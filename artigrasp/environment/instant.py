"""A scene in the middle of what happens in it, from which episodes may begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from artigrasp.kernels import resumes, states

HAND_FIELDS = tuple(states.element_types(resumes.HandInstant))
OBJECT_FIELDS = tuple(states.element_types(states.ObjectSlots))
"""What of an instant is about the hands, and what about the objects."""


@dataclass(frozen=True, eq=False)
class Instant:
    """H hands and O objects of one world at one instant; frames: world."""

    joint_q: NDArray[np.float32]
    """Joint coordinates of the hands [m | rad], shape [H, 51]."""
    joint_qd: NDArray[np.float32]
    """Their rates [m/s | rad/s], shape [H, 51]."""
    hand_base: NDArray[np.float32]
    """Frame that the wrist coordinates are relative to: position [m], quaternion xyzw, shape [H, 7]."""
    home: NDArray[np.float32]
    """Frames of the wrists where hands wait while they have nothing to do: position [m], quaternion xyzw, shape
    [H, 7]."""
    target: NDArray[np.float32]
    """PD targets [m | rad], shape [H, 51]."""
    stiffness: NDArray[np.float32]
    """PD stiffness of the ``DOF_GROUPS`` [N/m | N·m/rad], shape [H, 3]."""
    damping: NDArray[np.float32]
    """PD damping [N·s/m | N·m·s/rad], shape [H, 3]."""
    pose: NDArray[np.float32]
    """Frames of the objects' bases: position [m], quaternion xyzw, shape [O, 7]."""
    velocity: NDArray[np.float32]
    """Their velocities: linear [m/s], angular [rad/s], shape [O, 6]."""
    hinge_q: NDArray[np.float32]
    """Hinge angles [rad], shape [O]."""
    hinge_qd: NDArray[np.float32]
    """Their rates [rad/s], shape [O]."""

    def in_order(self, slots: Sequence[int]) -> Instant:
        """The same with its objects in another order: first the one that was in the first of these slots, and so on."""
        return replace(self, **{name: getattr(self, name)[list(slots)] for name in OBJECT_FIELDS})
