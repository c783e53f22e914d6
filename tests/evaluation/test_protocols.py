"""What counts as success, criterion by criterion."""

from typing import Any

import numpy as np
import pytest

from artigrasp.evaluation.protocols import GOAL_ANGLES, PROTOCOLS, measure_articulation
from tests.evaluation.examples import outcomes_of

EVERYWHERE = {"paper", "released", "strict"}


def test_the_goals_are_the_papers() -> None:
    """Five angles from half a radian to one and a half."""
    assert GOAL_ANGLES == (0.5, 0.75, 1.0, 1.25, 1.5)
    assert set(PROTOCOLS) == EVERYWHERE


@pytest.mark.parametrize(
    ("column", "passes", "fails", "where"),
    [
        ("final_angle", 0.3 + 1e-9, 0.3, EVERYWHERE),
        ("initial_angle", 0.599, 0.601, EVERYWHERE),
        ("initial_angle", 1.201, 1.199, EVERYWHERE),
        ("failed", False, True, EVERYWHERE),
        ("opened_once", True, False, {"released"}),
        ("final_angle", 2.0, 2.0 + 1e-9, {"released"}),
        ("final_displacement", 0.4, 0.4 + 1e-9, {"released"}),
        ("max_displacement", 0.05 - 1e-9, 0.05, {"strict"}),
        ("max_tilt", 0.3 - 1e-9, 0.3, {"strict"}),
    ],
)
def test_each_criterion_flips_at_its_threshold(column: str, passes: Any, fails: Any, where: set[str]) -> None:
    """On one side of it a trial counts in every protocol, on the other not in those that know the criterion."""
    for name, success in PROTOCOLS.items():
        assert success(outcomes_of(**{column: passes})).tolist() == [True], name
        assert success(outcomes_of(**{column: fails})).tolist() == [name not in where], name


def test_errors_are_over_all_trials() -> None:
    """AAE and SD count what did not succeed and what failed, in every protocol alike (the paper's "all")."""
    outcomes = outcomes_of(
        4, final_angle=[0.9, 0.0, 1.4, 0.0], mean_displacement=[0.0, 0.2, 0.0, 0.4], failed=[0, 0, 0, 1]
    )
    for row in measure_articulation(outcomes).values():
        assert row["aae"].value == pytest.approx((0.1 + 1.0 + 0.4 + 1.0) / 4)
        assert row["sd"].value == pytest.approx(0.15)
        assert row["suc_a"].value == 0.5
        assert {each.trials for each in row.values()} == {4}


def test_trials_of_one_reference_are_one_group() -> None:
    """The same number is another reference on another object; which text it came with does not matter."""
    outcomes = outcomes_of(6, object=["box", "box", "box", "lid", "lid", "lid"], reference=[0, 0, 1, 0, 1, 1])
    np.testing.assert_array_equal(outcomes.groups, [0, 0, 1, 2, 3, 3])


def test_some_trials_can_be_chosen() -> None:
    """Every column is cut alike."""
    outcomes = outcomes_of(5, final_angle=np.arange(5.0))
    chosen = outcomes.select(np.array([False, True, False, True, False]))
    assert chosen.final_angle.tolist() == [1.0, 3.0] and chosen.reference.tolist() == [1, 3]
    assert {len(column) for column in vars(chosen).values()} == {2}
