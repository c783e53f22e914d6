"""The reward, term by term (Section 4.3 of the paper)."""

import warp as wp

from .goals import contact_strength, is_touching, keypoint_error, manipulated_part_pose
from .kinematics import wrist_twist
from .layout import KEYPOINT_COUNT, LINK_COUNT, WRIST_DOF_COUNT
from .poses import turn_between
from .states import Goal, HandState, ObjectModel, ObjectState

TERMS = (
    "keypoint",
    "pose",
    "contact",
    "force",
    "hand_velocity",
    "object_velocity",
    "angle",
    "displacement",
)
"""Order of the reward terms."""

_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)
_LINK_COUNT = wp.constant(LINK_COUNT)
_KEYPOINT_COUNT = wp.constant(KEYPOINT_COUNT)
_KEYPOINT = wp.constant(TERMS.index("keypoint"))
_POSE = wp.constant(TERMS.index("pose"))
_CONTACT = wp.constant(TERMS.index("contact"))
_FORCE = wp.constant(TERMS.index("force"))
_HAND_VELOCITY = wp.constant(TERMS.index("hand_velocity"))
_OBJECT_VELOCITY = wp.constant(TERMS.index("object_velocity"))
_ANGLE = wp.constant(TERMS.index("angle"))
_DISPLACEMENT = wp.constant(TERMS.index("displacement"))
_Terms = wp.types.vector(length=len(TERMS), dtype=float)


@wp.struct
class RewardWeights:
    """Weights of the terms, all >= 0, and the cap of the force term; in brackets the paper's symbols and values.

    Attributes:
        keypoint: of the 16 joints [w_px 3], 1/m^2.
        fingertip: of the five fingertips [w_px 12], 1/m^2.
        pose: [w_pq 0.2], 1/rad.
        contact: [w_cc 1.5].
        force: [w_cf 1.5], 1/N.
        force_cap: largest counted force per kilogram of the object [lambda 5], N/kg.
        hand_linear_velocity: [w_rh 0.5], s^2/m^2.
        hand_angular_velocity: [w_rh 0.5], s^2/rad^2.
        object_velocity: of base and hinge [w_ro 0.2].
        angle: [w_tq 1.5], 1/rad.
        displacement: [w_tx 0.2], 1/m^2.
    """

    keypoint: float
    fingertip: float
    pose: float
    contact: float
    force: float
    force_cap: float
    hand_linear_velocity: float
    hand_angular_velocity: float
    object_velocity: float
    angle: float
    displacement: float


@wp.func
def norm_from_square(square: float) -> float:
    """Square root whose gradient at zero is zero."""
    norm = 0.0 * square
    if square > 0.0:
        norm = wp.sqrt(square)
    return norm


# Sums have functions of their own: Warp's adjoint of a function does not run its loops again before it goes backwards,
# so that what a loop has summed up may be used in the calling function only.


@wp.func
def keypoint_errors_squared(
    hand_state: HandState, goal: Goal, part: wp.transform, world: int, hand: int, first: int, end: int
) -> float:
    """Sum of the squared errors [m^2] of the keypoints from ``first`` to before ``end``."""
    total = wp.float32(0.0)
    for i in range(first, end):
        total += wp.length_sq(keypoint_error(hand_state, goal, part, world, hand, i))
    return total


@wp.func
def finger_errors_squared(hand_state: HandState, goal: Goal, world: int, hand: int) -> float:
    """Sum of the squared errors [rad^2] of the finger angles."""
    total = wp.float32(0.0)
    for i in range(goal.finger_angles.shape[2]):
        error = goal.finger_angles[world, hand, i] - hand_state.joint_q[world, hand, _WRIST_DOF_COUNT + i]
        total += error * error
    return total


@wp.func
def target_contacts(hand_state: HandState, goal: Goal, world: int, hand: int) -> wp.vec3:
    """Number of target contacts, number of those that are made, and the force [N] on them."""
    total = wp.vec3()
    for link in range(goal.contacts.shape[2]):
        strength = contact_strength(hand_state, goal, world, hand, link)
        total += goal.contacts[world, hand, link] * wp.vec3(1.0, is_touching(strength), strength)
    return total


@wp.kernel
def compute_rewards(
    hand_state: HandState,
    object_state: ObjectState,
    object_model: ObjectModel,
    goal: Goal,
    weights: RewardWeights,
    object_mass: wp.array[float],
    terms: wp.array3d[float],
    total: wp.array2d[float],
):
    """Reward of every hand; launch with ``dim=(W, H)`` after `forward_kinematics`.

    ::

        keypoint         -sum_i w_i |x_goal_i - x_i|^2          21 keypoints in the manipulated part's frame
        pose             -w |(rotation error, q_goal - q)|      wrist rotation vector and 45 finger angles
        contact           w (c_goal . [f > 0]) / (c_goal . c_goal)
        force             w min(c_goal . f, cap m)              newtons
        hand_velocity    -w_lin |v|^2 - w_ang |omega|^2         wrist, world frame
        object_velocity  -w (|v|^2 + |omega|^2 + hinge rate^2)  base and hinge, world frame
        angle            -w |goal angle - angle|
        displacement     -w |p_start - p|^2                     origin of the base

    Contacts and forces are those with `Goal.contact_part`. Hands that take no part get zeros. Differentiable, except
    that contacts switch between 0 and 1.

    Args:
        hand_state, object_state, object_model, goal: see `states`.
        weights: see `RewardWeights`.
        object_mass: [W] the mass m of the force cap, kg: what a hand can be asked to move, so the articulated part's
            with a fixed base, else the whole object's.
        terms: [W, H, 8] output, weighted, order `TERMS`.
        total: [W, H] output, their sum.
    """
    world, hand = wp.tid()
    result = _Terms()
    if goal.active[world, hand] != 0:
        part = manipulated_part_pose(object_state, object_model, goal, world, hand)

        joint_error = keypoint_errors_squared(hand_state, goal, part, world, hand, 0, _LINK_COUNT)
        tip_error = keypoint_errors_squared(hand_state, goal, part, world, hand, _LINK_COUNT, _KEYPOINT_COUNT)
        result[_KEYPOINT] = -weights.keypoint * joint_error - weights.fingertip * tip_error

        wrist_in_part = wp.transform_inverse(part) * hand_state.link_pose[world, hand, 0]
        rotation_error = turn_between(wrist_in_part, goal.wrist_pose_in_part[world, hand])
        finger_error = finger_errors_squared(hand_state, goal, world, hand)
        result[_POSE] = -weights.pose * norm_from_square(wp.length_sq(rotation_error) + finger_error)

        contacts = target_contacts(hand_state, goal, world, hand)
        result[_CONTACT] = weights.contact * contacts[1] / wp.max(contacts[0], 1.0)
        result[_FORCE] = weights.force * wp.min(contacts[2], weights.force_cap * object_mass[world])

        wrist_velocity = wrist_twist(hand_state, world, hand)
        result[_HAND_VELOCITY] = -weights.hand_linear_velocity * wp.length_sq(
            wp.spatial_top(wrist_velocity)
        ) - weights.hand_angular_velocity * wp.length_sq(wp.spatial_bottom(wrist_velocity))
        rate = object_state.hinge_qd[world]
        result[_OBJECT_VELOCITY] = -weights.object_velocity * (wp.length_sq(object_state.velocity[world]) + rate * rate)

        result[_ANGLE] = -weights.angle * wp.abs(goal.angle[world] - object_state.hinge_q[world])
        offset = wp.transform_get_translation(object_state.pose[world]) - wp.transform_get_translation(
            goal.start_object_pose[world]
        )
        result[_DISPLACEMENT] = -weights.displacement * wp.length_sq(offset)

    sum_of_terms = wp.float32(0.0)
    for term in range(terms.shape[2]):
        terms[world, hand, term] = result[term]
        sum_of_terms += result[term]
    total[world, hand] = sum_of_terms
