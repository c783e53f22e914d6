"""Poses as arrays, position [m] and quaternion xyzw, and as SciPy's transforms."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import Array
from artigrasp.kernels.layout import WRIST_DOF_COUNT


def to_transforms(poses: NDArray[np.floating]) -> RigidTransform:
    """The transforms of poses, in one row: of shape [N] for poses of shape [..., 7]."""
    flat = poses.reshape(-1, 7).astype(np.float64)
    return RigidTransform.from_components(flat[:, :3], Rotation.from_quat(flat[:, 3:]))


def to_poses(transforms: RigidTransform) -> Array:
    """The poses of transforms, shape [..., 7], w >= 0."""
    position, rotation = transforms.as_components()
    return np.concatenate([position, rotation.as_quat(canonical=True)], axis=-1)


def compose_poses(outer: NDArray[np.floating], inner: NDArray[np.floating]) -> Array:
    """Poses given in other poses, in the frame of the latter: position, quaternion xyzw, shape [..., 7]."""
    return to_poses(to_transforms(outer) * to_transforms(inner)).reshape(outer.shape)


def invert_poses(poses: NDArray[np.floating]) -> Array:
    """The inverses of poses: position, quaternion xyzw, shape [..., 7]."""
    return to_poses(to_transforms(poses).inv()).reshape(poses.shape)


def wrist_moves(joint_q: NDArray[np.floating]) -> Array:
    """What the first six joint coordinates [..., 51] do to the wrist: position [m], quaternion xyzw, shape [..., 7]."""
    shape = joint_q.shape[:-1]
    turn = Rotation.from_euler("XYZ", joint_q[..., 3:WRIST_DOF_COUNT].reshape(-1, 3))
    return np.concatenate([joint_q[..., :3], turn.as_quat().reshape(*shape, 4)], axis=-1)
