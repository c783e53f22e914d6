"""Trials that did not succeed, once more."""

import numpy as np
import pytest

from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.evaluation.articulation import ARTICULATION, toward
from artigrasp.evaluation.composed import COMPOSED
from artigrasp.evaluation.evaluate import Evaluation, choose_references, evaluate
from artigrasp.evaluation.failures import choose_failures, replay_failures
from artigrasp.references.reference import load_references
from artigrasp.tasks import get_task
from tests.evaluation.examples import evaluation_of, outcomes_of


def test_different_causes_come_first() -> None:
    """Of each object one trial of each cause, the most common one before, then the next; successes never."""
    hardly, little, success = 0.0, 0.2, 0.9
    final = np.array([success, little, hardly, hardly, hardly, little, success, success, hardly])
    outcomes = outcomes_of(9, object=["box"] * 7 + ["laptop"] * 2, final_angle=final, opened_once=final > 0.3)
    evaluation = evaluation_of(outcomes)
    assert choose_failures(evaluation, 1).tolist() == [2, 8]
    assert choose_failures(evaluation, 3).tolist() == [2, 1, 3, 8]
    assert choose_failures(evaluation, 9).tolist() == [2, 1, 3, 5, 4, 8]
    assert choose_failures(evaluation_of(outcomes_of(3)), 2).tolist() == []


@pytest.mark.parametrize("experiment", [toward([1.0]), COMPOSED], ids=["one phase", "sequence"])
def test_they_go_as_they_went(experiment) -> None:
    """A failure ends in its motion as it did when it was measured, whatever it was measured together with."""
    controller = pd_ik_controller(get_task("both-free"))
    references = [load_references("open-box")]
    evaluation = evaluate(controller, references, experiment, split="test", per_object=8)
    assert isinstance(evaluation, Evaluation)
    failures = replay_failures(evaluation, controller, references, 1)
    assert len(failures) == 1
    (failure,) = failures
    outcomes, metrics = evaluation.outcomes, failure.motion.metrics
    for name, column in (("final_angle", "final_angle"), ("goal_angle", "goal_angle")):
        assert metrics[name] == pytest.approx(getattr(outcomes, column)[failure.trial], abs=1e-6)
    if experiment is COMPOSED:
        assert metrics["position_error"] == pytest.approx(outcomes.position_error[failure.trial], abs=1e-6)
    assert failure.cause == outcomes.cause[failure.trial] != ""


def test_only_hands_of_the_scene_play() -> None:
    """References of the left hand are none for a scene of the right one."""
    references = [load_references("open-box")]
    right, both = (
        choose_references(references, ARTICULATION, "test", get_task(name))[0] for name in ("right-fixed", "both-free")
    )
    assert 0 < len(right) < len(both) and right.active[:, 1].all()
