"""How far a hand is from its goal: the errors that features and rewards share (Sections 4.2 and 4.3 of the paper)."""

import warp as wp

from .kinematics import part_pose
from .states import Goal, HandState, ObjectModel, ObjectState

CONTACT_THRESHOLD = wp.constant(1.0e-3)
"""Force [N] from which a link counts as touching."""


@wp.func
def manipulated_part_pose(
    object_state: ObjectState, object_model: ObjectModel, goal: Goal, world: int, hand: int
) -> wp.transform:
    """Frame, in the world, of the part that a hand manipulates."""
    return part_pose(
        object_state.pose[world],
        object_model.hinge_origin[world],
        object_model.hinge_axis[world],
        object_state.hinge_q[world],
        goal.part[world, hand],
    )


@wp.func
def keypoint_error(hand_state: HandState, goal: Goal, part: wp.transform, world: int, hand: int, index: int) -> wp.vec3:
    """From a keypoint to its goal, in the part's frame, m; ``part`` is the part's frame in the world."""
    current = wp.transform_point(wp.transform_inverse(part), hand_state.keypoint[world, hand, index])
    return goal.keypoint_in_part[world, hand, index] - current


@wp.func
def contact_strength(hand_state: HandState, goal: Goal, world: int, hand: int, link: int) -> float:
    """Force [N] between a link and the part whose contacts count; over both parts, the sum of the magnitudes."""
    part = goal.contact_part[world, hand]
    strength = wp.length(hand_state.contact_force[world, hand, link, wp.max(part, 0)])
    if part < 0:
        strength = strength + wp.length(hand_state.contact_force[world, hand, link, 1])
    return strength


@wp.func
def is_touching(strength: float) -> float:
    """1 where a force [N] is a contact, else 0."""
    return wp.where(strength > CONTACT_THRESHOLD, 1.0, 0.0)
