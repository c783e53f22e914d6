"""Articulation, from references and goals to what counts as success."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller, ZeroController, pd_ik_controller
from artigrasp.errors import UserError
from artigrasp.evaluation.articulation import ARTICULATION, GOAL_ANGLES, toward
from artigrasp.evaluation.evaluate import Evaluation, evaluate
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks import get_task
from tests.evaluation.examples import outcomes_of
from tests.example_references import box_references

PAPER = get_task("right-fixed")
EVERYWHERE = {"paper", "released", "strict"}


@pytest.fixture
def references() -> list[ReferenceSet]:
    """Three train references, two of another split, and one of them for grasping."""
    references = box_references(test_count=3)
    kind = references.kind.astype("<U10")
    kind[4] = "grasp"
    return [replace(references, kind=kind)]


def measured(controller: Controller, references: list[ReferenceSet], **options: Any) -> Evaluation[Any]:
    """Evaluate on two threads."""
    evaluation = evaluate(controller, references, ARTICULATION, simulator=SimulatorConfig(threads=2), **options)
    assert evaluation is not None
    return evaluation


def test_the_goals_are_the_papers() -> None:
    """Five angles from half a radian to one and a half."""
    assert GOAL_ANGLES == (0.5, 0.75, 1.0, 1.25, 1.5)
    assert set(ARTICULATION.criteria) == EVERYWHERE


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
    """On one side of it a trial counts by every criterion, on the other not by those that know it."""
    for name, success in ARTICULATION.criteria.items():
        assert success(outcomes_of(**{column: passes})).tolist() == [True], name
        assert success(outcomes_of(**{column: fails})).tolist() == [name not in where], name


def test_every_reference_meets_every_goal(references: list[ReferenceSet]) -> None:
    """Articulation references of the split alone, counted as `generate` counts them, each toward the five goals."""
    done: list[tuple[float, int]] = []
    short = replace(PAPER, episode_steps=2)
    evaluation = measured(
        ZeroController(short), references, split="test", seed=3, on_trial=lambda *progress: done.append(progress)
    )
    outcomes = evaluation.outcomes
    assert done == [(0.0, 10), (5.0, 10), (10.0, 10), (10, 10)]
    assert outcomes.goal_angle.tolist() == pytest.approx(GOAL_ANGLES * 2)
    assert outcomes.reference.tolist() == [0] * 5 + [1] * 5
    assert outcomes.source.tolist() == ["made by hand 3"] * 5 + ["made by hand 5"] * 5
    assert set(outcomes.object) == {"lidded-box"} and not outcomes.initial_angle.any()
    assert (evaluation.task, evaluation.controller, evaluation.split, evaluation.seed) == (short, "zero", "test", 3)
    assert evaluation.wall_time > 0.0 and evaluation.rollout_count == 0
    settings = evaluation.settings
    assert (settings["hand"], settings["base"], settings["episode_steps"], settings["friction"]) == (
        "open",
        "fixed",
        2,
        3.0,
    )
    assert settings.keys() >= {"cone", "impratio", "solref", "solimp", "timestep", "mujoco", "newton"}


def test_what_is_measured_is_what_happened(references: list[ReferenceSet]) -> None:
    """PD+IK opens the box toward each goal, and again exactly so: trials have no noise, whatever the seed."""
    controller = pd_ik_controller(PAPER)
    first, second = (measured(controller, references, split="train", seed=seed) for seed in (0, 1))
    outcomes = first.outcomes
    assert (outcomes.final_angle > 0.3).all() and outcomes.opened_once.all() and not outcomes.failed.any()
    assert (np.diff(outcomes.final_angle.reshape(-1, 5)[:, :3], axis=1) > 0.1).all(), "further goals, wider lids"
    assert not outcomes.max_displacement.any(), "the base is fixed"
    for name, column in outcomes.columns().items():
        np.testing.assert_array_equal(second.outcomes.columns()[name], column, err_msg=name)


def test_other_goals_can_be_asked_for(references: list[ReferenceSet]) -> None:
    """Each reference once toward each of them."""
    trials = toward([0.8, 1.1]).draw_trials([references[0].select(split="train", kind="articulate")], 0)
    assert trials.targets["goal_angle"].tolist() == [0.8, 1.1] * 3 and trials.reference.tolist() == [0, 0, 1, 1, 2, 2]


def test_a_split_without_articulation_is_named(references: list[ReferenceSet]) -> None:
    """There is nothing to measure."""
    with pytest.raises(UserError, match=r"lidded-box: references of 'recon' .*articulate.*: found none"):
        measured(ZeroController(PAPER), references, split="recon")
