"""Reward of the outcome: how far hinge and base are from their goals over the episode and at its end."""

import warp as wp

from .states import Goal, ObjectState

wp.set_module_options({"enable_backward": False})

OUTCOME_TERMS = ("outcome_error", "outcome_mean_error", "outcome_success", "outcome_displacement")
"""Final hinge angle error, mean hinge angle error, success at the end, and mean displacement of the base from its
start; not in the paper."""


@wp.kernel
def add_outcome_reward(
    object_state: ObjectState,
    goal: Goal,
    step: wp.array[int],
    episode_steps: int,
    opened_angle: float,
    weights: wp.vec4,
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
        weights: of `OUTCOME_TERMS`: 1/rad, 1/rad, 1, 1/m.
        terms: [W, H, 4] output, weighted.
        total: [W, H] their sum is added to it.
    """
    world, hand = wp.tid()
    active = float(goal.active[world, hand])
    error = wp.abs(goal.angle[world] - object_state.hinge_q[world])
    change = wp.abs(object_state.hinge_q[world] - goal.start_angle[world])
    start = wp.transform_get_translation(goal.start_object_pose[world])
    displacement = wp.length(wp.transform_get_translation(object_state.pose[world]) - start)
    last = wp.where(step[world] >= episode_steps, active, 0.0)
    terms[world, hand, 0] = -weights[0] * error * last
    terms[world, hand, 1] = -weights[1] * error * active / float(episode_steps)
    terms[world, hand, 2] = weights[2] * wp.where(change > opened_angle, last, 0.0)
    terms[world, hand, 3] = -weights[3] * displacement * active / float(episode_steps)
    for term in range(terms.shape[2]):
        total[world, hand] += terms[world, hand, term]
