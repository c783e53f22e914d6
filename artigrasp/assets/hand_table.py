"""Hands as kernels read them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand_model import HandModel
from artigrasp.kernels import states
from artigrasp.kernels.layout import WRIST_DOF_COUNT


def hand_table(hands: Sequence[HandModel], device: str) -> states.HandModel:
    """Offsets and limits of hands, in their order, on a Warp device."""
    table = states.hand_model(len(hands), device)
    for name in states.field_names(states.HandModel):
        getattr(table, name).assign(np.stack([getattr(hand, name) for hand in hands]).astype(np.float32))
    return table


def put_hands(hands: states.HandState, wrist_pose: NDArray[np.floating], finger_angles: NDArray[np.floating]) -> None:
    """Put the bases of hands at their wrists, so that the six wrist coordinates are zero, and bend their fingers.

    Args:
        hands: W worlds of H hands.
        wrist_pose: Wrist frames: position [m], quaternion xyzw, shape [W, H, 7].
        finger_angles: Finger angles [rad], shape [W, H, 45].
    """
    joint_q = np.zeros(hands.joint_q.shape, np.float32)
    joint_q[..., WRIST_DOF_COUNT:] = finger_angles
    hands.joint_q.assign(joint_q)
    hands.hand_base.assign(wrist_pose.astype(np.float32))
