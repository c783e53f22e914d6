"""The reward, term by term (Section 4.3 of the paper)."""

import warp as wp

from .goals import contact_strength, is_touching, keypoint_error, manipulated_part_pose, wrist_rotation_error
from .kinematics import wrist_twist
from .layout import LINK_COUNT, WRIST_DOF_COUNT
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


@wp.func
def contact_terms(
    hand_state: HandState,
    goal: Goal,
    weights: RewardWeights,
    object_mass: float,
    world: int,
    hand: int,
) -> wp.vec2:
    """Fraction of the target contacts that are made, and the capped force on them; zero without target contacts."""
    wanted_count = wp.float32(0.0)
    made_count = wp.float32(0.0)
    force = wp.float32(0.0)
    for link in range(goal.contacts.shape[2]):
        wanted = goal.contacts[world, hand, link]
        strength = contact_strength(hand_state, goal, world, hand, link)
        wanted_count += wanted
        made_count += wanted * is_touching(strength)
        force += wanted * strength
    return wp.vec2(
        weights.contact * made_count / wp.max(wanted_count, 1.0),
        weights.force * wp.min(force, weights.force_cap * object_mass),
    )


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

        joint_error = wp.float32(0.0)
        tip_error = wp.float32(0.0)
        for i in range(_LINK_COUNT, goal.keypoint_in_part.shape[2]):
            tip_error += wp.length_sq(keypoint_error(hand_state, goal, part, world, hand, i))
        for i in range(goal.contacts.shape[2]):
            joint_error += wp.length_sq(keypoint_error(hand_state, goal, part, world, hand, i))
        result[_KEYPOINT] = -weights.keypoint * joint_error - weights.fingertip * tip_error

        wrist_in_part = wp.transform_inverse(part) * hand_state.link_pose[world, hand, 0]
        pose_error = wp.length_sq(wrist_rotation_error(wrist_in_part, goal.wrist_pose_in_part[world, hand]))
        finger_error = wp.float32(0.0)
        for i in range(goal.finger_angles.shape[2]):
            difference = goal.finger_angles[world, hand, i] - hand_state.joint_q[world, hand, _WRIST_DOF_COUNT + i]
            finger_error += difference * difference
        result[_POSE] = -weights.pose * norm_from_square(pose_error + finger_error)

        contact = contact_terms(hand_state, goal, weights, object_mass[world], world, hand)
        result[_CONTACT] = contact[0]
        result[_FORCE] = contact[1]

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

    total_reward = wp.float32(0.0)
    for term in range(terms.shape[2]):
        terms[world, hand, term] = result[term]
        total_reward += result[term]
    total[world, hand] = total_reward
