"""Bookkeeping of episodes: which reference a world plays, how far it is, and which decisions hold."""

import warp as wp

from .states import PhaseState

wp.set_module_options({"enable_backward": False})

EPISODE_STRIDE = wp.constant(7919)
"""Between the seeds of a world's draws in one episode and the next."""
_REFERENCE_STREAM = wp.constant(104729)


@wp.func
def _draw_weighted(weight: wp.array[float], first: int, count: int, fraction: float) -> int:
    """The one of a range at which the sum of weights passes a fraction of the whole."""
    total = wp.float32(0.0)
    for index in range(first, first + count):
        total += weight[index]
    left = wp.float32(fraction * total)
    drawn = wp.int32(first + count - 1)
    for index in range(first, first + count):
        left -= weight[index]
        if left < 0.0:
            drawn = index
            break
    return drawn


@wp.kernel
def begin_episodes(
    world_mask: wp.array[int],
    first_reference: wp.array[int],
    reference_count: wp.array[int],
    reference_weight: wp.array[float],
    practice: float,
    episode: wp.array[int],
    seed: int,
    # outputs
    reference_index: wp.array[int],
    step: wp.array[int],
    diverged: wp.array[int],
    overflow_count: wp.array[int],
):
    """Draw a reference for every masked world and set its clock to zero; launch with ``dim=W``.

    Args:
        world_mask: [W] int, 1 where an episode begins.
        first_reference, reference_count: [W] range of references that a world draws from; a count of one fixes it.
        reference_weight: [R] how much a reference counts where they are not drawn alike.
        practice: share of the episodes that draw in proportion to these weights.
        episode: [W] episodes begun so far; the draw is a function of seed, world and this count.
        seed: of the draw.
        reference_index: [W] output.
        step: [W] output, control steps since the reset.
        diverged, overflow_count: [W] outputs, cleared: see ``simulation.state``.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    random = wp.rand_init(seed + _REFERENCE_STREAM + EPISODE_STRIDE * episode[world], world)
    first, count = first_reference[world], reference_count[world]
    reference_index[world] = first + wp.randi(random, 0, count)
    if wp.randf(random) < practice:
        reference_index[world] = _draw_weighted(reference_weight, first, count, wp.randf(random))
    step[world] = 0
    diverged[world] = 0
    overflow_count[world] = 0


@wp.kernel
def keep_references(
    world_mask: wp.array[int],
    reference_index: wp.array[int],
    keep_second: int,
    # outputs
    phase_references: wp.array2d[int],
):
    """Let the phases of an episode play the reference that was drawn for it; launch with ``dim=W``.

    Args:
        world_mask: [W] int, 1 where an episode begins.
        reference_index: [W] int, what was drawn.
        keep_second: 0 where the phases have a second reference of their own.
        phase_references: [W, 2] int output.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    phase_references[world, 0] = reference_index[world]
    if keep_second != 0:
        phase_references[world, 1] = reference_index[world]


@wp.kernel
def latch_actions(
    action: wp.array3d[float],
    phase: PhaseState,
    columns: wp.array2d[int],
    decision_interval: wp.array[int],
    adds_up: wp.array[int],
    # outputs
    held: wp.array3d[float],
):
    """Take one term from the action where a decision is due; launch with ``dim=(W, H)``.

    Args:
        action: [W, H, A] the newest actions.
        phase: see `states`.
        columns: [P, K] where each number of the term stands in the action of a phase; negative where it is not in use
            and stays zero.
        decision_interval: [P] control steps for which a decision holds; zero where the last one goes on holding,
            negative where the phase does not have the term, which then is zero.
        adds_up: [P] int, 1 where every decision after the first is added to those before it.
        held: [W, H, K] output, the decisions in force.
    """
    world, hand = wp.tid()
    index = phase.index[world]
    interval = decision_interval[index]
    if interval < 0:
        for number in range(held.shape[2]):
            held[world, hand, number] = 0.0
    elif interval > 0 and phase.decision_step[world] % interval == 0:
        for number in range(held.shape[2]):
            column = columns[index, number]
            before = held[world, hand, number]
            if adds_up[index] == 0 or phase.decision_step[world] == 0:
                before = 0.0
            held[world, hand, number] = 0.0
            if column >= 0:
                held[world, hand, number] = before + action[world, hand, column]


@wp.kernel
def advance_steps(step: wp.array[int], phase: PhaseState):
    """Count one control step of the episode, the phase and the decisions; launch with ``dim=W``."""
    world = wp.tid()
    step[world] += 1
    phase.step[world] += 1
    phase.decision_step[world] += 1
