"""Forward kinematics of the hand and of the hinged object."""

import warp as wp

from .layout import ARTICULATED, FINGERS, LINK_COUNT, TIP_FINGERS, WRIST_DOF_COUNT
from .rotations import euler_xyz_to_quat
from .states import HandModel, HandState

_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)
_LINK_COUNT = wp.constant(LINK_COUNT)
_ARTICULATED = wp.constant(ARTICULATED)
_TIP_OF_FINGER = wp.types.vector(length=len(FINGERS), dtype=int)(*(TIP_FINGERS.index(name) for name in FINGERS))
"""Position in the fingertip order of each finger in the joint order."""


@wp.func
def pose_fingers(
    root: wp.transform,
    angles: wp.array3d[float],
    first_angle: int,
    world: int,
    hand: int,
    model: HandModel,
    link_pose: wp.array3d[wp.transform],
    keypoint: wp.array3d[wp.vec3],
):
    """Write the link frames and keypoints of one hand whose wrist frame is ``root``, in the frame of ``root``.

    The 45 finger angles [rad] are read from ``angles[world, hand, first_angle:]``.
    """
    # A bound that the compiler does not know keeps the loop a loop: unrolled it would compile for many seconds.
    finger_count = model.tip_offset.shape[1]
    link_pose[world, hand, 0] = root
    keypoint[world, hand, 0] = wp.transform_get_translation(root)
    for finger in range(finger_count):
        pose = root
        for joint in range(3):
            link = 1 + 3 * finger + joint
            angle = first_angle + 3 * (link - 1)
            rotation = euler_xyz_to_quat(
                angles[world, hand, angle], angles[world, hand, angle + 1], angles[world, hand, angle + 2]
            )
            pose = pose * wp.transform(model.link_offset[hand, link], rotation)
            link_pose[world, hand, link] = pose
            keypoint[world, hand, link] = wp.transform_get_translation(pose)
        tip = _TIP_OF_FINGER[finger]
        keypoint[world, hand, _LINK_COUNT + tip] = wp.transform_point(pose, model.tip_offset[hand, tip])


@wp.func
def wrist_pose(state: HandState, world: int, hand: int) -> wp.transform:
    """Wrist link frame in the world: ``hand_base * T(q[0:3]) * Rx Ry Rz(q[3:6])``."""
    translation = wp.vec3(state.joint_q[world, hand, 0], state.joint_q[world, hand, 1], state.joint_q[world, hand, 2])
    rotation = euler_xyz_to_quat(
        state.joint_q[world, hand, 3], state.joint_q[world, hand, 4], state.joint_q[world, hand, 5]
    )
    return state.hand_base[world, hand] * wp.transform(translation, rotation)


@wp.func
def wrist_twist(state: HandState, world: int, hand: int) -> wp.spatial_vector:
    """Velocity of the wrist link: linear (of its origin, m/s), then angular (rad/s), world frame.

    The base frame is at rest; the three wrist hinges turn about x, then the turned y, then the twice turned z.
    """
    linear = wp.vec3(state.joint_qd[world, hand, 0], state.joint_qd[world, hand, 1], state.joint_qd[world, hand, 2])
    turn_x = euler_xyz_to_quat(state.joint_q[world, hand, 3], 0.0, 0.0)
    turn_xy = euler_xyz_to_quat(state.joint_q[world, hand, 3], state.joint_q[world, hand, 4], 0.0)
    angular = wp.vec3(state.joint_qd[world, hand, 3], 0.0, 0.0)
    angular += wp.quat_rotate(turn_x, wp.vec3(0.0, state.joint_qd[world, hand, 4], 0.0))
    angular += wp.quat_rotate(turn_xy, wp.vec3(0.0, 0.0, state.joint_qd[world, hand, 5]))
    base = wp.transform_get_rotation(state.hand_base[world, hand])
    return wp.spatial_vector(wp.quat_rotate(base, linear), wp.quat_rotate(base, angular))


@wp.func
def part_pose(
    object_pose: wp.transform, hinge_origin: wp.vec3, hinge_axis: wp.vec3, angle: float, part: int
) -> wp.transform:
    """Frame of a part in the world: ``base * T(origin) * Rot(axis, angle) * T(-origin)``, or the base itself."""
    pose = object_pose
    if part == _ARTICULATED:
        turn = wp.quat_from_axis_angle(hinge_axis, angle)
        pose = object_pose * wp.transform(hinge_origin - wp.quat_rotate(turn, hinge_origin), turn)
    return pose


@wp.func
def part_twist(
    object_pose: wp.transform,
    object_velocity: wp.spatial_vector,
    hinge_origin: wp.vec3,
    hinge_axis: wp.vec3,
    angle: float,
    rate: float,
    part: int,
) -> wp.spatial_vector:
    """Velocity of a part: linear (of its frame's origin, m/s), then angular (rad/s), world frame.

    Args:
        object_pose: base frame in the world.
        object_velocity: linear velocity of the base frame's origin and angular velocity, world frame.
        hinge_origin, hinge_axis: hinge in the base frame.
        angle, rate: hinge angle [rad] and its rate [rad/s].
        part: index of the part.
    """
    linear = wp.spatial_top(object_velocity)
    angular = wp.spatial_bottom(object_velocity)
    if part == _ARTICULATED:
        origin = wp.transform_get_translation(part_pose(object_pose, hinge_origin, hinge_axis, angle, part))
        hinge_rate = rate * wp.transform_vector(object_pose, hinge_axis)
        linear = (
            linear
            + wp.cross(angular, origin - wp.transform_get_translation(object_pose))
            + wp.cross(hinge_rate, origin - wp.transform_point(object_pose, hinge_origin))
        )
        angular = angular + hinge_rate
    return wp.spatial_vector(linear, angular)


@wp.kernel
def forward_kinematics(state: HandState, model: HandModel):
    """Link frames and keypoints of every hand, written to ``state.link_pose`` and ``state.keypoint``.

    Launch with ``dim=(W, H)``. Frames: world; m. Differentiable in ``joint_q`` and ``hand_base``.
    """
    world, hand = wp.tid()
    root = wrist_pose(state, world, hand)
    pose_fingers(root, state.joint_q, _WRIST_DOF_COUNT, world, hand, model, state.link_pose, state.keypoint)
