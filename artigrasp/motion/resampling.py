"""The same motion at other times."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from artigrasp.arrays import Array
from artigrasp.motion.motion import Motion, MotionBystanders


def resample(motion: Motion, time: Array) -> Motion:
    """What a motion is at other times, in between the samples.

    Positions and angles run straight from sample to sample, orientations the short way round; forces and phases are
    those of the sample before.

    Args:
        motion: The motion.
        time: Strictly increasing times within those of the motion [s], shape ``[N]``.
    """
    before = np.clip(np.searchsorted(motion.time, time + 1e-9, side="right") - 1, 0, len(motion.time) - 1)
    bystanders = motion.bystanders
    if bystanders is not None:
        poses = [_poses(motion.time, poses, time) for poses in np.moveaxis(bystanders.pose, 1, 0)]
        bystanders = MotionBystanders(
            objects=bystanders.objects,
            pose=np.stack(poses, axis=1),
            hinge_angle=_straight(motion.time, bystanders.hinge_angle, time),
            focus=bystanders.focus[before],
        )
    return replace(
        motion,
        time=time,
        joint_q=_straight(motion.time, motion.joint_q, time),
        object_pose=_poses(motion.time, motion.object_pose, time),
        hinge_angle=_straight(motion.time, motion.hinge_angle, time),
        contact_force=motion.contact_force[before],
        phases=motion.phases[before],
        bystanders=bystanders,
    )


def _straight(time: Array, values: NDArray[np.float32], wanted: Array) -> NDArray[np.float32]:
    """Linear interpolation along the first axis."""
    after = np.clip(np.searchsorted(time, wanted, side="right"), 1, max(len(time) - 1, 1))
    if len(time) == 1:
        return np.repeat(values, len(wanted), axis=0)
    share = np.clip((wanted - time[after - 1]) / (time[after] - time[after - 1]), 0, 1)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1 - share) * values[after - 1] + share * values[after], np.float32)


def _poses(time: Array, poses: NDArray[np.float32], wanted: Array) -> NDArray[np.float32]:
    """Poses (position [m], quaternion xyzw) in between, shape ``[N, 7]``."""
    if len(time) == 1:
        return np.repeat(poses, len(wanted), axis=0)
    turns = Slerp(time, Rotation.from_quat(poses[:, 3:]))(np.clip(wanted, time[0], time[-1]))
    return np.concatenate([_straight(time, poses[:, :3], wanted), turns.as_quat()], axis=1).astype(np.float32)
