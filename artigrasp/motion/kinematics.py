"""Where the hand links and the object parts of a motion are."""

from collections.abc import Sequence

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_table import hand_table, put_hands
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels import states
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.layout import PARTS
from artigrasp.kernels.parts import pose_parts
from artigrasp.motion.file import Motion, MotionReference
from artigrasp.references.reference import ReferenceSet

_DEVICE = "cpu"


def link_poses(motion: Motion, hands: Sequence[HandModel]) -> NDArray[np.float32]:
    """Poses of all hand links.

    Args:
        motion: The motion.
        hands: The model of each hand of the motion.

    Returns:
        Link frames in the world: position [m], quaternion xyzw, shape ``[T, H, 16, 7]``.
    """
    state = states.hand_state(len(motion.time), len(hands), _DEVICE)
    state.joint_q.assign(motion.joint_q)
    state.hand_base.assign(np.broadcast_to(motion.hand_base, (len(motion.time), *motion.hand_base.shape)))
    return _link_poses(state, hands)


def reference_link_poses(reference: MotionReference, hands: Sequence[HandModel]) -> NDArray[np.float32]:
    """Poses of all hand links in the reference.

    Args:
        reference: The reference of a motion.
        hands: The model of each hand of the motion.

    Returns:
        Link frames in the frame of the part that each hand manipulates: position [m], quaternion xyzw, shape
        ``[H, 16, 7]``.
    """
    state = states.hand_state(1, len(hands), _DEVICE)
    put_hands(state, reference.wrist_pose_in_part[None], reference.finger_angles)
    poses: NDArray[np.float32] = _link_poses(state, hands)[0]
    return poses


def posed_references(
    references: ReferenceSet, hands: Sequence[HandModel], object: ObjectModel
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Poses of all hand links and both object parts in R references, the object where each of them begins.

    Args:
        references: The references.
        hands: The model of each hand.
        object: The model of their object.

    Returns:
        Link frames, shape ``[R, 2, 16, 7]``, and part frames, shape ``[R, 2, 7]``, in the world: position [m],
        quaternion xyzw.
    """
    parts = pose_object(references.object_pose, references.object_angle, object)
    of_hands = np.take_along_axis(parts, references.part[:, :, None].astype(np.int64), axis=1)
    turn = Rotation.from_quat(of_hands[..., 3:].reshape(-1, 4))
    wrists = references.wrist_pose_in_part.reshape(-1, 7)
    positions = turn.apply(wrists[:, :3]) + of_hands[..., :3].reshape(-1, 3)
    orientations = (turn * Rotation.from_quat(wrists[:, 3:])).as_quat()
    state = states.hand_state(len(references), len(hands), _DEVICE)
    in_world = np.concatenate([positions, orientations], axis=1).reshape(len(references), len(hands), 7)
    put_hands(state, in_world, references.finger_angles)
    return _link_poses(state, hands), parts


def part_poses(motion: Motion, object: ObjectModel) -> NDArray[np.float32]:
    """Poses of both object parts.

    Args:
        motion: The motion.
        object: The model of its object.

    Returns:
        Part frames in the world: position [m], quaternion xyzw, shape ``[T, 2, 7]``.
    """
    return pose_object(motion.object_pose, motion.hinge_angle, object)


def pose_object(
    object_pose: NDArray[np.floating], hinge_angle: NDArray[np.floating], object: ObjectModel
) -> NDArray[np.float32]:
    """Poses of both parts of an object in N configurations.

    Args:
        object_pose: Poses of the base: position [m], quaternion xyzw, shape ``[N, 7]``.
        hinge_angle: Hinge angles [rad], shape ``[N]``.
        object: The model of the object.

    Returns:
        Part frames in the frame that the base poses are given in: position [m], quaternion xyzw, shape ``[N, 2, 7]``.
    """
    count = len(hinge_angle)
    model, state = states.object_model(count, _DEVICE), states.object_state(count, _DEVICE)
    model.hinge_origin.fill_(wp.vec3(*object.hinge_origin))
    model.hinge_axis.fill_(wp.vec3(*object.hinge_axis))
    state.pose.assign(object_pose)
    state.hinge_q.assign(hinge_angle)
    poses = wp.zeros((count, len(PARTS)), dtype=wp.transform, device=_DEVICE)
    wp.launch(pose_parts, dim=poses.shape, inputs=[state, model], outputs=[poses], device=_DEVICE)
    return np.asarray(poses.numpy(), np.float32)


def _link_poses(state: states.HandState, hands: Sequence[HandModel]) -> NDArray[np.float32]:
    every_hand = state.joint_q.shape[:2]
    wp.launch(forward_kinematics, dim=every_hand, inputs=[state, hand_table(hands, _DEVICE)], device=_DEVICE)
    return np.asarray(state.link_pose.numpy(), np.float32)
