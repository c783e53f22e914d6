"""Reward of the outcome: where hinge and base are over the episode and at its end, and where they should be."""

import warp as wp

from .poses import angle_between, distance_between
from .states import Goal, ObjectState

wp.set_module_options({"enable_backward": False})

OUTCOME_TERMS = (
    "outcome_error",
    "outcome_mean_error",
    "outcome_success",
    "outcome_displacement",
    "outcome_lift",
    "outcome_position_error",
    "outcome_rotation_error",
)
"""Of the hinge: final error, mean error, and success at the end. Of the base: mean displacement from its start, whether
it is lifted at the end, and its final distance and angle from its target. None is in the paper."""

FARTHEST = wp.constant(0.5)
"""Final errors of the base beyond this count as this [m, rad]: a dropped object is lost, wherever it lies."""


@wp.kernel
def add_outcome_reward(
    object_state: ObjectState,
    goal: Goal,
    step: wp.array[int],
    episode_steps: int,
    opened_angle: float,
    lifted_height: float,
    weights: wp.array[float],
    # outputs
    terms: wp.array3d[float],
    total: wp.array2d[float],
):
    """Rewards of the outcome for every hand that takes part; launch with ``dim=(W, H)`` after the step was counted.

    Args:
        object_state, goal: see `states`.
        step: [W] control steps done; the last one is ``episode_steps``.
        episode_steps: control steps per episode.
        opened_angle: change of the angle that counts as success, rad.
        lifted_height: height over the start from which the base counts as lifted, m.
        weights: [7] of `OUTCOME_TERMS`: 1/rad, 1/rad, 1, 1/m, 1, 1/m, 1/rad.
        terms: [W, H, 7] output, weighted.
        total: [W, H] their sum is added to it.
    """
    world, hand = wp.tid()
    active = float(goal.active[world, hand])
    error = wp.abs(goal.angle[world] - object_state.hinge_q[world])
    change = wp.abs(object_state.hinge_q[world] - goal.start_angle[world])
    pose, start, target = object_state.pose[world], goal.start_object_pose[world], goal.target_object_pose[world]
    offset = wp.transform_get_translation(pose) - wp.transform_get_translation(start)
    last = wp.where(step[world] >= episode_steps, active, 0.0)
    terms[world, hand, 0] = -weights[0] * error * last
    terms[world, hand, 1] = -weights[1] * error * active / float(episode_steps)
    terms[world, hand, 2] = weights[2] * wp.where(change > opened_angle, last, 0.0)
    terms[world, hand, 3] = -weights[3] * wp.length(offset) * active / float(episode_steps)
    terms[world, hand, 4] = weights[4] * wp.where(offset[2] > lifted_height, last, 0.0)
    terms[world, hand, 5] = -weights[5] * wp.min(distance_between(target, pose), FARTHEST) * last
    terms[world, hand, 6] = -weights[6] * wp.min(angle_between(target, pose), FARTHEST) * last
    for term in range(terms.shape[2]):
        total[world, hand] += terms[world, hand, term]
