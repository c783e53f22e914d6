"""The hands of a motion as MANO's parameters, for whoever has a licence of MANO and its tools."""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array, save_arrays
from artigrasp.kernels.layout import FINGER_DOF_COUNT, LINK_COUNT, WRIST_DOF_COUNT
from artigrasp.motion.motion import Motion
from artigrasp.references.mano_pose import mano_translation, rotation_vectors

MANO_FORMAT, MANO_VERSION = "artigrasp.mano", 1
BETA_COUNT = 10


def mano_parameters(motion: Motion) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Poses and translations with which MANO's mean shape has its links where the hands have theirs.

    With the hand ``mano`` that is so to rounding; other hands have other proportions, and only the wrist and the
    directions of the links are the same.

    Args:
        motion: The motion.

    Returns:
        Rotation vectors of the wrist in the world and of the 15 finger joints, the mean pose included [rad], shape
        ``[T, H, 16, 3]``, and translations [m], shape ``[T, H, 3]``.
    """
    pose = np.empty((len(motion.time), len(motion.hands), LINK_COUNT, 3), np.float32)
    translation = np.empty((*pose.shape[:2], 3), np.float32)
    joint_q = motion.joint_q.astype(np.float64)
    for hand, side in enumerate(motion.hands):
        base = Rotation.from_quat(motion.hand_base[hand, 3:])
        wrist = base * Rotation.from_euler("XYZ", joint_q[:, hand, 3:WRIST_DOF_COUNT])
        position = motion.hand_base[hand, :3] + base.apply(joint_q[:, hand, :3])
        pose[:, hand, 0] = wrist.as_rotvec()
        pose[:, hand, 1:] = rotation_vectors(joint_q[:, hand, WRIST_DOF_COUNT:]).reshape(-1, LINK_COUNT - 1, 3)
        translation[:, hand] = mano_translation(position, side)
    return pose, translation


def export_mano(motion: Motion, path: str | os.PathLike[str], *, mean_pose: dict[str, Array] | None = None) -> None:
    """Write MANO's parameters of a motion by the names that ``smplx`` and ARCTIC know them by.

    Args:
        motion: The motion.
        path: The ``.npz`` to write; ``docs/motion-format.md`` describes it.
        mean_pose: MANO's mean pose of each side, rotation vectors [rad], shape (45,), to be left out of the fingers'
            pose, as MANO's own files do; by default the pose counts from the flat hand.

    Raises:
        UserError: The place cannot be written to.
    """
    pose, translation = mano_parameters(motion)
    arrays: dict[str, Any] = {
        "time": motion.time,
        "hands": np.asarray(motion.hands),
        "flat_hand_mean": np.asarray(mean_pose is None),
    }
    for hand, side in enumerate(motion.hands):
        left_out = np.zeros(FINGER_DOF_COUNT) if mean_pose is None else mean_pose[side]
        arrays[f"{side}_global_orient"] = pose[:, hand, 0]
        arrays[f"{side}_hand_pose"] = (pose[:, hand, 1:].reshape(-1, FINGER_DOF_COUNT) - left_out).astype(np.float32)
        arrays[f"{side}_transl"] = translation[:, hand]
        arrays[f"{side}_betas"] = np.zeros((len(motion.time), BETA_COUNT), np.float32)
    save_arrays(path, MANO_FORMAT, MANO_VERSION, arrays)
