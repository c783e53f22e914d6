"""The cross-entropy method on problems whose solutions are known."""

import numpy as np
import pytest

from artigrasp.controllers.cross_entropy import CrossEntropy, CrossEntropySettings

GOALS = np.array([[0.5, -1.0, 0.3], [0.0, 0.0, 0.0], [-1.2, 0.8, 1.5]])


def run(goals: np.ndarray, settings: CrossEntropySettings, seeds: list[tuple[int, int]]) -> CrossEntropy:
    """Search for each goal; the score is minus the distance."""
    search = CrossEntropy(seeds, goals.shape[1], settings)
    while search.rollouts_left:
        candidates = search.propose()
        search.learn(candidates, -np.linalg.norm(candidates - goals[:, None], axis=-1))
    return search


def test_it_finds_what_is_best() -> None:
    """With two hundred rollouts in three dimensions it gets near, and much nearer than its first draws."""
    settings = CrossEntropySettings(rollouts=208, least_std=0.1)
    search = run(GOALS, settings, [(0, 1), (0, 2), (0, 3)])
    assert search.candidates.shape == (3, 208, 3) and search.scores.shape == (3, 208)
    found = search.candidates[np.arange(3), search.best()]
    np.testing.assert_allclose(found, GOALS, atol=0.25)
    first, last = search.scores[[0, 2], 1:16], search.scores[[0, 2], -16:]
    assert (np.median(last, axis=1) > np.median(first, axis=1) + 0.5).all()


def test_the_first_candidate_is_zero() -> None:
    """What is searched around is tried itself, once."""
    search = run(GOALS, CrossEntropySettings(rollouts=8, population=4), [(0, 1), (0, 2), (0, 3)])
    assert not search.candidates[:, 0].any() and search.candidates[:, 1:].all()
    assert search.best(1).tolist() == [0, 0, 0] and search.best()[1] == 0


@pytest.mark.parametrize(("rollouts", "drawn"), [(1, [1]), (5, [1, 4]), (8, [1, 4, 3])])
def test_no_more_rollouts_than_asked_for(rollouts: int, drawn: list[int]) -> None:
    """The first candidate comes by itself, and the last population is cut."""
    search = CrossEntropy([(0,)], 3, CrossEntropySettings(rollouts=rollouts, population=4))
    counts = []
    while search.rollouts_left:
        candidates = search.propose()
        counts.append(candidates.shape[1])
        search.learn(candidates, np.zeros(candidates.shape[:2]))
    assert counts == drawn


def test_problems_do_not_see_each_other() -> None:
    """Searched alone or beside others, a problem's candidates are the same; another seed gives others."""
    settings = CrossEntropySettings(rollouts=20, population=5)
    together = run(GOALS, settings, [(0, 1), (0, 2), (0, 3)])
    alone = run(GOALS[2:], settings, [(0, 3)])
    np.testing.assert_array_equal(alone.candidates[0], together.candidates[2])
    other = run(GOALS[2:], settings, [(1, 3)])
    assert (other.candidates[0, 1:] != alone.candidates[0, 1:]).all()


def test_nothing_is_learned_where_all_do_alike() -> None:
    """Scores without a difference leave the search as wide as it was."""
    settings = CrossEntropySettings(rollouts=400, population=200, initial_std=0.7)
    search = CrossEntropy([(0, 1)], 12, settings)
    for count in (1, 200):
        search.learn(candidates := search.propose(), np.full(candidates.shape[:2], -1.0))
        assert candidates.shape[1] == count
    assert search.propose().std() == pytest.approx(0.7, abs=0.03)


def test_what_is_given_up_keeps_its_best() -> None:
    """Candidates without a score do not count, and do not disturb the others."""
    settings = CrossEntropySettings(rollouts=21, population=5)
    whole = run(GOALS, settings, [(0, 1), (0, 2), (0, 3)])
    search = CrossEntropy([(0, 1), (0, 2), (0, 3)], 3, settings)
    while search.rollouts_left:
        candidates = search.propose()
        scores = -np.linalg.norm(candidates - GOALS[:, None], axis=-1)
        if search.candidates.shape[1] >= 6:
            scores[1] = -np.inf
        search.learn(candidates, scores)
    assert search.best()[1] < 6
    np.testing.assert_array_equal(search.candidates[[0, 2]], whole.candidates[[0, 2]])
