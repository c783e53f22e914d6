"""Episodes begin, decisions hold, and steps are counted."""

import numpy as np
import pytest
import warp as wp

from artigrasp.kernels import states
from artigrasp.kernels.episodes import advance_steps, begin_episodes, keep_references, latch_actions

WORLD_COUNT = 400
FIRST, COUNT = 3, 5
UNTOUCHED = 77


def begin(
    mask: np.ndarray,
    episode: int = 0,
    seed: int = 0,
    count: int = COUNT,
    *,
    weight: np.ndarray | None = None,
    practice: float = 0.0,
) -> dict[str, np.ndarray]:
    """Begin episodes where the mask is one; every output holds ``UNTOUCHED`` before."""
    names = ("reference_index", "step", "diverged", "overflow_count")
    outputs = {name: wp.full(WORLD_COUNT, UNTOUCHED, dtype=int) for name in names}
    arrays = (mask, np.full(WORLD_COUNT, FIRST), np.full(WORLD_COUNT, count), np.full(WORLD_COUNT, episode))
    *plans, episodes = (wp.array(array, dtype=int) for array in arrays)
    weights = wp.array(np.ones(FIRST + COUNT) if weight is None else weight, dtype=float)
    wp.launch(
        begin_episodes,
        dim=WORLD_COUNT,
        inputs=[*plans, weights, practice, episodes, seed],
        outputs=list(outputs.values()),
    )
    return {name: array.numpy() for name, array in outputs.items()}


def test_only_masked_worlds_begin() -> None:
    """A masked world draws a reference of its range and forgets clock and failures; the others stay as they were."""
    mask = np.arange(WORLD_COUNT) % 2
    outputs = begin(mask)
    for name in ("step", "diverged", "overflow_count"):
        np.testing.assert_array_equal(outputs[name], np.where(mask == 1, 0, UNTOUCHED))
    drawn = outputs["reference_index"]
    np.testing.assert_array_equal(drawn[mask == 0], UNTOUCHED)
    assert set(drawn[mask == 1]) == set(range(FIRST, FIRST + COUNT))


def test_draws_are_even_and_repeatable() -> None:
    """Every reference comes up about as often as the others; seed and episode decide, and nothing else."""
    everyone = np.ones(WORLD_COUNT, int)
    draws = {key: begin(everyone, *key)["reference_index"] for key in [(0, 0), (1, 0), (0, 1)]}
    for drawn in draws.values():
        counts = np.bincount(drawn - FIRST, minlength=COUNT)
        assert (np.abs(counts - WORLD_COUNT / COUNT) < 4 * np.sqrt(WORLD_COUNT / COUNT)).all()
    np.testing.assert_array_equal(begin(everyone)["reference_index"], draws[0, 0])
    for key in [(1, 0), (0, 1)]:
        assert 0.05 < (draws[key] == draws[0, 0]).mean() < 0.4, "as many agree as by chance"


def test_practice_draws_by_weight() -> None:
    """That share of the episodes draws in proportion to the weights of the range, the others draw all alike."""
    everyone, weight = np.ones(WORLD_COUNT, int), np.full(FIRST + COUNT, 50.0)
    weight[FIRST:] = (3.0, 0.0, 1.0, 0.0, 4.0)
    for practice in (0.0, 0.5, 1.0):
        draws = [begin(everyone, seed=seed, weight=weight, practice=practice)["reference_index"] for seed in range(10)]
        share = np.bincount(np.concatenate(draws) - FIRST, minlength=COUNT) / (10 * WORLD_COUNT)
        expected = practice * weight[FIRST:] / weight[FIRST:].sum() + (1 - practice) / COUNT
        np.testing.assert_allclose(share, expected, atol=0.03)
        assert practice < 1.0 or not share[weight[FIRST:] == 0.0].any()


def test_a_count_of_one_fixes_the_reference() -> None:
    """Trials play the reference that they are given."""
    outputs = begin(np.ones(WORLD_COUNT, int), count=1)
    np.testing.assert_array_equal(outputs["reference_index"], FIRST)


@pytest.mark.parametrize("keep_second", [0, 1])
def test_phases_play_the_reference_that_was_drawn(keep_second: int) -> None:
    """Where an episode begins, it is their first one, and their second one unless they have another."""
    mask, drawn, before = np.array([1, 0, 1]), np.array([5, 6, 7]), np.array([[1, 2], [1, 2], [1, 2]])
    references = wp.array(before, dtype=int)
    inputs = [wp.array(mask, dtype=int), wp.array(drawn, dtype=int), keep_second]
    wp.launch(keep_references, dim=3, inputs=inputs, outputs=[references])
    expected = [[5, 5], [1, 2], [7, 7]] if keep_second else [[5, 2], [1, 2], [7, 2]]
    np.testing.assert_array_equal(references.numpy(), expected)


@pytest.mark.parametrize("interval", [1, 4])
def test_decisions_hold_for_their_interval(interval: int) -> None:
    """A term takes its own columns of the action, and only when a decision is due."""
    action, held, found = latch(np.zeros(9), np.arange(9), columns=[[6, -1, 8]], interval=[interval])
    due = np.arange(9) % interval == 0
    np.testing.assert_array_equal(found[due][..., [0, 2]], action[due][..., [6, 8]])
    assert (found[due][..., 1] == 0.0).all(), "a number that is not in use is zero"
    np.testing.assert_array_equal(found[~due], held[~due])


def test_every_phase_has_its_own_terms() -> None:
    """A phase has its own columns and intervals; one without the term has zeros, one that decides nothing keeps."""
    phase, step = np.repeat(np.arange(4), 4), np.tile(np.arange(4), 4)
    action, held, found = latch(phase, step, columns=[[0, 1, 2], [7, 8, 9], [-1] * 3, [-1] * 3], interval=[1, 2, 0, -1])
    np.testing.assert_array_equal(found[phase == 0], action[phase == 0, :, :3])
    due = (phase == 1) & (step % 2 == 0)
    np.testing.assert_array_equal(found[due], action[due, :, 7:])
    kept = (phase == 2) | ((phase == 1) & ~due)
    np.testing.assert_array_equal(found[kept], held[kept])
    assert (found[phase == 3] == 0.0).all()


def test_decisions_may_add_up() -> None:
    """The first decision of an episode stands alone; each later one is added to what holds."""
    step = np.arange(9)
    action, held, found = latch(np.zeros(9), step, columns=[[6, -1, 8]], interval=[4], adds_up=[1])
    np.testing.assert_array_equal(found[0][:, [0, 2]], action[0][:, [6, 8]])
    for due in (4, 8):
        expected = held[due][:, [0, 2]] + action[due][:, [6, 8]]
        np.testing.assert_allclose(found[due][:, [0, 2]], expected, rtol=1e-6)
    np.testing.assert_array_equal(found[step % 4 != 0], held[step % 4 != 0])


def latch(
    phase: np.ndarray, step: np.ndarray, columns: list[list[int]], interval: list[int], adds_up: list[int] | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An action of 10 columns, the 3 decisions in force before, and those after."""
    rng = np.random.default_rng(0)
    worlds = len(phase)
    action = rng.normal(size=(worlds, 2, 10)).astype(np.float32)
    held = rng.normal(size=(worlds, 2, 3)).astype(np.float32)
    state = states.phase_state(worlds)
    state.index.assign(phase.astype(np.int32))
    state.decision_step.assign(step.astype(np.int32))
    array = wp.array(held, dtype=float)
    sums = adds_up or [0] * len(interval)
    settings = [wp.array(columns, dtype=int), wp.array(interval, dtype=int), wp.array(sums, dtype=int)]
    wp.launch(latch_actions, dim=(worlds, 2), inputs=[wp.array(action, dtype=float), state, *settings], outputs=[array])
    return action, held, array.numpy()


def test_steps_are_counted() -> None:
    """One per world and launch, on all three clocks."""
    step, phase = wp.array([0, 7], dtype=int), states.phase_state(2)
    phase.step.assign([3, 0])
    phase.decision_step.assign([1, 9])
    wp.launch(advance_steps, dim=2, inputs=[step, phase])
    clocks = (step, phase.step, phase.decision_step)
    assert [clock.numpy().tolist() for clock in clocks] == [[1, 8], [4, 1], [2, 10]]
