"""The grasping experiment."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.evaluation.evaluate import evaluate
from artigrasp.evaluation.grasping import GRASPING, GraspOutcomes, draw_targets, with_targets
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks import get_task
from tests.evaluation.examples import QUALITY
from tests.example_references import box_references


def grasp_references(test_count: int = 2) -> ReferenceSet:
    """The box's references as grasps of the base, which they hardly lift."""
    references = box_references(test_count=test_count)
    return replace(references, kind=np.full(len(references), "grasp"), part=np.zeros_like(references.part))


def outcomes_of(count: int, **columns: Any) -> GraspOutcomes:
    """Trials that succeed in every reading, except for the given columns."""
    fields: dict[str, Any] = {
        "object": "box", "reference": 0, "source": "made by hand", "failed": False, "target_height": 0.3, "lift": 0.29,
        "position_error": 0.01, "rotation_error": 0.1, "turn": 0.3, "grasp_outcome": "done", "carry_outcome": "done",
        **QUALITY,
    }  # fmt: skip
    return GraspOutcomes(**{name: np.resize(value, count) for name, value in (fields | columns).items()})


def test_the_first_phase_that_failed_is_the_cause() -> None:
    """Whatever else went wrong came of it; failed physics explains all."""
    outcomes = outcomes_of(
        4,
        grasp_outcome=["not grasped", "done", "done", "done"],
        carry_outcome=["dropped", "slipped", "done", "dropped"],
        failed=[False, False, False, True],
    )
    assert outcomes.cause.tolist() == ["grasp: not grasped", "relocate: slipped", "", "physics"]


def test_success_needs_height_and_in_the_strict_reading_the_target() -> None:
    """Lifted by more than 0.1 m; strictly, within 5 cm and 0.2 rad of the target; never with failed physics."""
    outcomes = outcomes_of(
        5,
        lift=[0.3, 0.1, 0.3, 0.3, 0.3],
        failed=[False, False, True, False, False],
        position_error=[0.04, 0.01, 0.01, 0.06, 0.01],
        rotation_error=[0.19, 0.1, 0.1, 0.1, 0.21],
    )
    assert GRASPING.criteria["paper"](outcomes).tolist() == [True, False, False, True, True]
    assert GRASPING.criteria["released"](outcomes).tolist() == [True, False, False, True, True]
    assert GRASPING.criteria["strict"](outcomes).tolist() == [True, False, False, False, False]
    measured = GRASPING.measure(outcomes)["paper"]
    assert measured["suc_g"].value == 0.6
    np.testing.assert_allclose([measured[key].value for key in ("pe", "ae", "ae_released")], [0.026, 0.14, 0.3])


def test_targets_are_those_of_the_paper() -> None:
    """Thirty for each reference: within .15 m sideways, .15 to .45 m up, turned by up to .3 rad about each axis."""
    trials = draw_targets([grasp_references(97)], seed=0)
    assert len(trials) == 3000 and np.bincount(trials.reference).tolist() == [30] * 100
    offset = trials.targets["target_offset"]
    turn = Rotation.from_quat(offset[:, 3:]).as_rotvec()
    for values, low, high in ((offset[:, :2], -0.15, 0.15), (offset[:, 2], 0.15, 0.45), (turn, -0.3, 0.3)):
        assert low <= values.min() < low + 0.01 and high - 0.01 < values.max() <= high
        np.testing.assert_allclose(values.mean(axis=0), (low + high) / 2, atol=0.01)


def test_targets_do_not_depend_on_what_else_is_measured() -> None:
    """They follow from the seed and the reference alone, so that a subset has the same trials."""
    references = grasp_references()
    all_targets = draw_targets([references], seed=3).targets["target_offset"].reshape(len(references), 30, 7)
    alone = draw_targets([references.select(indices=3)], seed=3).targets["target_offset"]
    np.testing.assert_array_equal(alone, all_targets[3])
    few = with_targets(2).draw_trials([references], 3)
    np.testing.assert_array_equal(few.targets["target_offset"].reshape(len(references), 2, 7), all_targets[:, :2])
    assert (draw_targets([references], seed=4).targets["target_offset"] != all_targets.reshape(-1, 7)).any()


def test_every_trial_is_played() -> None:
    """Spread over the references; a hand that hooks the lid cannot lift the box, and errors tell how far it is."""
    steps: list[float] = []
    evaluation = evaluate(
        pd_ik_controller(get_task("both-free")),
        [grasp_references()],
        GRASPING,
        split="test",
        per_object=3,
        simulator=SimulatorConfig(threads=2),
        on_trial=lambda done, total: steps.append(done / total),
    )
    outcomes = evaluation.outcomes
    assert outcomes.reference.tolist() == [0, 0, 1] and outcomes.source[2] == "made by hand 4"
    assert not outcomes.failed.any() and steps[-1] == 1.0 and np.all(np.diff(steps) >= 0)
    assert set(outcomes.grasp_outcome) <= {"done", "not grasped", "toppled"}
    offset = evaluation.trials.targets["target_offset"]
    np.testing.assert_array_equal(outcomes.target_height, offset[:, 2])
    assert (np.abs(outcomes.lift) < 0.5).all() and (outcomes.position_error < 1.0).all()
