"""The feature vector of the policy, block by block as `layout.FEATURES` lists it (Section 4.2 of the paper)."""

import warp as wp

from .goals import contact_strength, is_touching, keypoint_error, manipulated_part_pose
from .kinematics import part_twist, wrist_twist
from .layout import WRIST_DOF_COUNT, feature_slice
from .poses import turn_between
from .rotations import quat_to_rotation_vector
from .states import Goal, HandState, ObjectModel, ObjectState

_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)
FINGER_ANGLES = wp.constant(feature_slice("finger_angles").start)
FINGER_VELOCITIES = wp.constant(feature_slice("finger_velocities").start)
LINK_FORCES = wp.constant(feature_slice("link_forces").start)
WRIST_VELOCITY = wp.constant(feature_slice("wrist_velocity_in_part").start)
PART_POSE = wp.constant(feature_slice("part_pose_in_wrist").start)
PART_VELOCITY = wp.constant(feature_slice("part_velocity_in_wrist").start)
HINGE = wp.constant(feature_slice("hinge_in_wrist").start)
POSE_ERROR = wp.constant(feature_slice("pose_error").start)
KEYPOINT_ERROR = wp.constant(feature_slice("keypoint_error_in_part").start)
CONTACT_GOAL = wp.constant(feature_slice("contact_goal").start)
ANGLE_ERROR = wp.constant(feature_slice("angle_error").start)


@wp.func
def write_vector(features: wp.array3d[float], world: int, hand: int, column: int, v: wp.vec3):
    """Three consecutive features."""
    for axis in range(3):
        features[world, hand, column + axis] = v[axis]


@wp.func
def write_hinge(
    features: wp.array3d[float],
    world: int,
    hand: int,
    wrist: wp.transform,
    object_state: ObjectState,
    object_model: ObjectModel,
):
    """The hinge as the wrist sees it.

    Direction of the axis (unit, opening sense), direction from the wrist straight to the axis line (unit; zero on the
    axis), the distance [m], the masses of the articulated part and the base [kg].
    """
    rotation = wp.transform_get_rotation(wrist)
    axis = wp.transform_vector(object_state.pose[world], object_model.hinge_axis[world])
    origin = wp.transform_point(object_state.pose[world], object_model.hinge_origin[world])
    to_origin = origin - wp.transform_get_translation(wrist)
    to_axis = to_origin - wp.dot(to_origin, axis) * axis
    write_vector(features, world, hand, HINGE, wp.quat_rotate_inv(rotation, axis))
    write_vector(features, world, hand, HINGE + 3, wp.quat_rotate_inv(rotation, wp.normalize(to_axis)))
    features[world, hand, HINGE + 6] = wp.length(to_axis)
    features[world, hand, HINGE + 7] = object_model.part_mass[world, 1]
    features[world, hand, HINGE + 8] = object_model.part_mass[world, 0]


@wp.kernel
def compute_features(
    hand_state: HandState,
    object_state: ObjectState,
    object_model: ObjectModel,
    goal: Goal,
    with_hinge: int,
    features: wp.array3d[float],
):
    """Features of every hand; launch with ``dim=(W, H)`` after `forward_kinematics`.

    "Part" is the part that the hand manipulates, "wrist" the wrist link's frame. Differentiable, except that contacts
    switch between 0 and 1.

    Args:
        hand_state, object_state, object_model, goal: see `states`.
        with_hinge: 0 leaves the block ``hinge_in_wrist`` at zero (the paper's ablation of I_art).
        features: [W, H, 279] output; blocks, frames and units as in `layout.FEATURES`.
    """
    world, hand = wp.tid()
    finger_dof_count = goal.finger_angles.shape[2]
    link_count = goal.contacts.shape[2]
    keypoint_count = goal.keypoint_in_part.shape[2]

    for i in range(finger_dof_count):
        angle = hand_state.joint_q[world, hand, _WRIST_DOF_COUNT + i]
        features[world, hand, FINGER_ANGLES + i] = angle
        features[world, hand, FINGER_VELOCITIES + i] = hand_state.joint_qd[world, hand, _WRIST_DOF_COUNT + i]
        features[world, hand, POSE_ERROR + 3 + i] = goal.finger_angles[world, hand, i] - angle

    part = manipulated_part_pose(object_state, object_model, goal, world, hand)
    part_rotation = wp.transform_get_rotation(part)
    wrist = hand_state.link_pose[world, hand, 0]
    wrist_rotation = wp.transform_get_rotation(wrist)
    wrist_velocity = wrist_twist(hand_state, world, hand)
    part_velocity = part_twist(
        object_state.pose[world],
        object_state.velocity[world],
        object_model.hinge_origin[world],
        object_model.hinge_axis[world],
        object_state.hinge_q[world],
        object_state.hinge_qd[world],
        goal.part[world, hand],
    )
    relative_velocity = part_velocity - wrist_velocity

    linear = wp.spatial_top(wrist_velocity)
    angular = wp.spatial_bottom(wrist_velocity)
    write_vector(features, world, hand, WRIST_VELOCITY, wp.quat_rotate_inv(part_rotation, linear))
    write_vector(features, world, hand, WRIST_VELOCITY + 3, wp.quat_rotate_inv(part_rotation, angular))

    part_in_wrist = wp.transform_inverse(wrist) * part
    turn = quat_to_rotation_vector(wp.transform_get_rotation(part_in_wrist))
    write_vector(features, world, hand, PART_POSE, wp.transform_get_translation(part_in_wrist))
    write_vector(features, world, hand, PART_POSE + 3, turn)
    features[world, hand, PART_POSE + 6] = object_state.hinge_q[world]

    relative_linear = wp.spatial_top(relative_velocity)
    relative_angular = wp.spatial_bottom(relative_velocity)
    write_vector(features, world, hand, PART_VELOCITY, wp.quat_rotate_inv(wrist_rotation, relative_linear))
    write_vector(features, world, hand, PART_VELOCITY + 3, wp.quat_rotate_inv(wrist_rotation, relative_angular))
    features[world, hand, PART_VELOCITY + 6] = object_state.hinge_qd[world]

    if with_hinge != 0:
        write_hinge(features, world, hand, wrist, object_state, object_model)
    else:
        for i in range(9):
            features[world, hand, HINGE + i] = 0.0

    rotation_error = turn_between(wp.transform_inverse(part) * wrist, goal.wrist_pose_in_part[world, hand])
    write_vector(features, world, hand, POSE_ERROR, rotation_error)
    for i in range(keypoint_count):
        error = keypoint_error(hand_state, goal, part, world, hand, i)
        write_vector(features, world, hand, KEYPOINT_ERROR + 3 * i, error)

    for link in range(link_count):
        net_force = hand_state.contact_force[world, hand, link, 0] + hand_state.contact_force[world, hand, link, 1]
        features[world, hand, LINK_FORCES + link] = wp.length(net_force)
        wanted = goal.contacts[world, hand, link]
        touching = is_touching(contact_strength(hand_state, goal, world, hand, link))
        features[world, hand, CONTACT_GOAL + link] = wanted
        features[world, hand, CONTACT_GOAL + link_count + link] = wanted - touching

    features[world, hand, ANGLE_ERROR] = goal.angle[world] - object_state.hinge_q[world]
