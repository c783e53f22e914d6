"""Trials, from references and goals to outcomes."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.controllers.controller import ZeroController, pd_ik_controller
from artigrasp.errors import UserError
from artigrasp.evaluation.articulation import evaluate_articulation
from artigrasp.evaluation.protocols import GOAL_ANGLES
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks import get_task
from tests.example_references import box_references

PAPER = get_task("right-fixed")


@pytest.fixture
def references() -> list[ReferenceSet]:
    """Three train references, two of another split, and one of them for grasping."""
    references = box_references(test_count=3)
    kind = references.kind.astype("<U10")
    kind[4] = "grasp"
    return [replace(references, kind=kind)]


def test_every_reference_meets_every_goal(references: list[ReferenceSet]) -> None:
    """Articulation references of the split alone, counted as `generate` counts them, each toward the five goals."""
    steps: list[int] = []
    short = replace(PAPER, episode_steps=2)
    evaluation = evaluate_articulation(ZeroController(short), references, split="test", seed=3, on_step=steps.append)
    outcomes = evaluation.outcomes
    assert steps == [0, 1, 2]
    assert outcomes.goal_angle.tolist() == pytest.approx(GOAL_ANGLES * 2)
    assert outcomes.reference.tolist() == [0] * 5 + [1] * 5
    assert outcomes.source.tolist() == ["made by hand 3"] * 5 + ["made by hand 5"] * 5
    assert set(outcomes.object) == {"lidded-box"} and not outcomes.initial_angle.any()
    assert (evaluation.task, evaluation.controller, evaluation.split, evaluation.seed) == (
        "right-fixed",
        "zero",
        "test",
        3,
    )
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
    first, second = (evaluate_articulation(controller, references, split="train", seed=seed) for seed in (0, 1))
    outcomes = first.outcomes
    assert (outcomes.final_angle > 0.3).all() and outcomes.opened_once.all() and not outcomes.failed.any()
    assert (np.diff(outcomes.final_angle.reshape(-1, 5)[:, :3], axis=1) > 0.1).all(), "further goals, wider lids"
    assert not outcomes.max_displacement.any(), "the base is fixed"
    for name, column in vars(outcomes).items():
        np.testing.assert_array_equal(getattr(second.outcomes, name), column, err_msg=name)


def test_a_split_without_articulation_is_named(references: list[ReferenceSet]) -> None:
    """There is nothing to measure."""
    with pytest.raises(UserError, match="lidded-box: references of 'recon' of 'articulate': found none"):
        evaluate_articulation(ZeroController(PAPER), references, split="recon")
