"""The composed task."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.errors import UserError
from artigrasp.evaluation import composed
from artigrasp.evaluation.composed import COMPOSED, ComposedOutcomes, draw_pairs
from artigrasp.evaluation.evaluate import evaluate
from artigrasp.evaluation.sequences import first_failures
from artigrasp.references.reference import ReferenceSet, join_references
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import GRASP_THEN_ARTICULATE
from tests.evaluation.examples import QUALITY
from tests.evaluation.test_grasping import grasp_references
from tests.example_references import box_references


def both_kinds() -> ReferenceSet:
    """Five articulations of the box, of which two are of the split test, and as many grasps."""
    return join_references([box_references(test_count=2), grasp_references(2)])


def outcomes_of(count: int, **columns: Any) -> ComposedOutcomes:
    """Trials that succeed in every reading, except for the given columns."""
    fields: dict[str, Any] = {
        "object": "box", "reference": 0, "source": "a", "failed": False, "articulation": 0, "articulation_source": "b",
        "goal_angle": 0.55, "final_angle": 0.5, "position_error": 0.02, "rotation_error": 0.1,
        "least_position_error": 0.01, "least_rotation_error": 0.05, "least_angle_error": 0.0, "failed_phase": "",
        **QUALITY,
    }  # fmt: skip
    return ComposedOutcomes(**{name: np.resize(value, count) for name, value in (fields | columns).items()})


def test_success_needs_pose_and_angle() -> None:
    """At the end within 5 cm, 0.2 rad and an angle: 0.5 rad in the paper, which a closed lid may pass, 0.2 strictly."""
    outcomes = outcomes_of(
        6,
        final_angle=[0.5, 0.3, 0.0, 0.5, 0.5, 0.5],
        goal_angle=[0.55, 0.55, 0.45, 0.55, 0.55, 0.55],
        position_error=[0.04, 0.02, 0.02, 0.06, 0.02, 0.02],
        rotation_error=[0.19, 0.1, 0.1, 0.1, 0.21, 0.1],
        failed=[False, False, False, False, False, True],
    )
    assert COMPOSED.criteria["paper"](outcomes).tolist() == [True, True, True, False, False, False]
    assert COMPOSED.criteria["strict"](outcomes).tolist() == [True, False, False, False, False, False]
    measured = COMPOSED.measure(outcomes)["paper"]
    np.testing.assert_allclose(measured["aae"].value, np.mean([0.05, 0.25, 0.45, 0.05, 0.05, 0.05]))


def test_the_authors_script_asks_whether_each_was_reached_once() -> None:
    """Whatever came later, unless the object is gone at the end."""
    outcomes = outcomes_of(
        5,
        position_error=[0.9, 1.1, 0.02, 0.02, 0.02],
        least_position_error=[0.04, 0.04, 0.06, 0.01, 0.01],
        least_rotation_error=[0.1, 0.1, 0.1, 0.21, 0.1],
        final_angle=[0.0, 0.0, 0.0, 0.0, 2.1],
    )
    assert COMPOSED.criteria["released"](outcomes).tolist() == [True, False, False, False, False]
    assert not COMPOSED.criteria["paper"](outcomes)[:2].any()


def test_what_stands_open_is_to_be_closed() -> None:
    """An object that begins beyond 1 rad, as a bottle whose cap hangs open, cannot be opened further by half a one."""
    references = join_references([box_references(test_count=2), grasp_references(2)])
    angle = np.where(np.arange(len(references)) % 2 == 0, 2.4, 0.9)
    trials = draw_pairs([replace(references, object_angle=angle.astype(np.float32))], seed=0)
    start = angle[trials.reference]
    way = np.where(start > 1.0, -1.0, 1.0) * (trials.targets["goal_angle"] - start)
    assert ((way > 0.499) & (way < 0.601)).all() and {0.9, 2.4} == set(start.tolist())


def test_every_grasp_meets_every_articulation() -> None:
    """Targets are .05 to .1 m back and left, turned by up to .4 rad about the vertical, open by .5 to .6 rad."""
    references = join_references([box_references(test_count=37), grasp_references(17)])
    trials = draw_pairs([references], seed=0)
    assert len(trials) == 40 * 20
    kinds = references.kind[trials.reference], references.kind[trials.targets["second_reference"]]
    assert set(kinds[0]) == {"grasp"} and set(kinds[1]) == {"articulate"}
    pairs = set(zip(trials.reference.tolist(), trials.targets["second_reference"].tolist(), strict=True))
    assert len(pairs) == len(trials)
    offset = trials.targets["target_offset"]
    turn = Rotation.from_quat(offset[:, 3:]).as_rotvec()
    for values, low, high in (
        (offset[:, :2], -0.1, -0.05), (turn[:, 2], -0.4, 0.4), (trials.targets["goal_angle"], 0.5, 0.6)
    ):  # fmt: skip
        assert low <= values.min() < low + 0.01 * (high - low) + 0.01 and high - 0.01 < values.max() <= high
    assert not turn[:, :2].any() and not offset[:, 2].any()


def test_an_object_needs_both_kinds() -> None:
    """The message names the object and what it lacks."""
    with pytest.raises(UserError, match="lidded-box: expected at least one grasp reference of the split, found none"):
        draw_pairs([box_references()], seed=0)


def test_the_first_failure_is_named() -> None:
    """Its phase and its cause; nothing for a sequence that went well."""
    outcomes = {
        "grasp": np.array(["done", "not grasped", "done"]),
        "relocate": np.array(["dropped", "dropped", "done"]),
        "articulate": np.array(["not reached", "running", "running"]),
    }
    assert first_failures(outcomes).tolist() == ["relocate: dropped", "grasp: not grasped", ""]


def test_every_pair_is_played(monkeypatch: pytest.MonkeyPatch) -> None:
    """Outcomes count references within their kinds, and tell where a trial failed."""
    short = tuple(replace(phase, least_steps=4, most_steps=8) for phase in GRASP_THEN_ARTICULATE)
    monkeypatch.setattr(composed, "GRASP_THEN_ARTICULATE", short)
    evaluation = evaluate(
        pd_ik_controller(get_task("both-free")), [both_kinds()], COMPOSED, split="test",
        simulator=SimulatorConfig(threads=2),
    )  # fmt: skip
    outcomes = evaluation.outcomes
    assert outcomes.reference.tolist() == [0, 0, 1, 1] and outcomes.articulation.tolist() == [0, 1, 0, 1]
    assert outcomes.groups.tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]] and outcomes.reference_count == 4
    assert set(outcomes.failed_phase) == {"grasp: not grasped"}
    np.testing.assert_allclose(outcomes.goal_angle, evaluation.trials.targets["goal_angle"], atol=1e-6)
    np.testing.assert_allclose(outcomes.rotation_error, np.abs(outcomes.rotation_error), atol=0.0)
    shift = np.linalg.norm(evaluation.trials.targets["target_offset"][:, :3], axis=1)
    np.testing.assert_allclose(outcomes.position_error, shift, atol=0.02)
    assert not COMPOSED.criteria["paper"](outcomes).any()
