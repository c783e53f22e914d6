"""Trials and outcomes as tables, and what is reported of them."""

import numpy as np
import pytest

from artigrasp.evaluation.articulation import ARTICULATION, ArticulationOutcomes
from artigrasp.evaluation.experiment import CRITERIA, Trials
from tests.evaluation.examples import outcomes_of


def test_errors_are_over_all_trials() -> None:
    """AAE and SD count what did not succeed and what failed, by every criterion alike (the paper's "all")."""
    outcomes = outcomes_of(
        4, final_angle=[0.9, 0.0, 1.4, 0.0], mean_displacement=[0.0, 0.2, 0.0, 0.4], failed=[0, 0, 0, 1]
    )
    measured = ARTICULATION.measure(outcomes)
    assert tuple(measured) == CRITERIA
    for row in measured.values():
        assert row["aae"].value == pytest.approx((0.1 + 1.0 + 0.4 + 1.0) / 4)
        assert row["sd"].value == pytest.approx(0.15)
        assert row["suc_a"].value == 0.5
        assert {each.trials for each in row.values()} == {4}


def test_trials_of_one_reference_are_one_group() -> None:
    """The same number is another reference on another object; which text it came with does not matter."""
    outcomes = outcomes_of(6, object=["box", "box", "box", "lid", "lid", "lid"], reference=[0, 0, 1, 0, 1, 1])
    np.testing.assert_array_equal(outcomes.groups[:, 0], [0, 0, 1, 2, 3, 3])


def test_outcomes_are_cut_and_joined() -> None:
    """Every column alike, in the order of the trials."""
    outcomes = outcomes_of(5, final_angle=np.arange(5.0))
    chosen = outcomes.select(np.array([False, True, False, True, False]))
    assert len(chosen) == 2 and chosen.final_angle.tolist() == [1.0, 3.0] and chosen.reference.tolist() == [1, 3]
    joined = ArticulationOutcomes.join([chosen, outcomes_of(1, object="espressomachine")])
    assert joined.object.tolist() == ["box", "box", "espressomachine"]
    assert {len(column) for column in joined.columns().values()} == {3}


def test_trials_are_cut() -> None:
    """With their targets, of any shape."""
    trials = Trials(
        np.array(["a", "a", "b"]), np.arange(3), {"angle": np.arange(3.0), "place": np.arange(9).reshape(3, 3)}
    )
    part = trials[1:3]
    assert (len(trials), len(part)) == (3, 2)
    assert part.object.tolist() == ["a", "b"] and part.targets["place"].tolist() == [[3, 4, 5], [6, 7, 8]]
