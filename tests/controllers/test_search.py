"""Search around a controller, on the lidded box."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from artigrasp.config import PhaseConfig, SynergyConfig
from artigrasp.controllers.controller import PD_IK, ZeroController, pd_ik_controller
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.rollout import run_episode
from artigrasp.controllers.search import Objective, SearchController, phases_until, with_offsets
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import planned_worlds, trial_worlds
from artigrasp.kernels.layout import FEATURE_COUNT
from artigrasp.tasks import get_task
from tests.environment.examples import TWO_THREADS
from tests.example_references import box_references

QUICK = replace(get_task("right-fixed"), episode_steps=160)
SETTINGS = CrossEntropySettings(rollouts=6, population=4)


def searched(rows: Sequence[int], seed: int = 0, **options: Any) -> tuple[SearchController, dict[str, np.ndarray]]:
    """Search for openings from some of the box's references, play the best, and say what was measured."""
    references = [box_references().select(indices=rows)]
    controller = SearchController(pd_ik_controller(QUICK), SETTINGS, seed=seed, **options)
    environment = Environment(
        controller.task, references, trial_worlds(references, [1.0]), noise=False, simulator=TWO_THREADS
    )
    steps: list[tuple[int, int]] = []
    run_episode(environment, controller, on_plan=lambda done, total: steps.append((done, total)))
    assert steps[0] == (0, 6 * 160) and steps[-1] == (6 * 160, 6 * 160)
    assert [done for done, _ in steps] == sorted(done for done, _ in steps)
    return controller, environment.episode_summary()


@pytest.fixture(scope="module")
def search() -> tuple[SearchController, dict[str, np.ndarray]]:
    """All three references."""
    return searched([0, 1, 2])


def test_what_is_played_is_the_best_that_was_tried(search: tuple[SearchController, dict[str, np.ndarray]]) -> None:
    """A fresh episode gives what the candidate gave, which is no worse than the controller searched around."""
    controller, summary = search
    found = controller.found
    assert found is not None and found.offsets.shape == (3, 1, 1, 14) and found.error.shape == (3, 6)
    np.testing.assert_array_equal(summary["angle_error"], found.error[:, -1])
    np.testing.assert_array_equal(summary["success"], found.success[:, -1])
    assert (found.error[:, -1] < found.error[:, 0]).any()
    assert (controller.name, controller.rollout_count, controller.parallel_count) == ("search", 6, 4)


def test_the_first_candidate_is_the_controller_itself(search: tuple[SearchController, dict[str, np.ndarray]]) -> None:
    """Rollout one of the search is PD+IK's episode."""
    controller, _ = search
    baseline = pd_ik_controller(QUICK)
    references = [box_references()]
    environment = Environment(
        baseline.task, references, trial_worlds(references, [1.0]), noise=False, simulator=TWO_THREADS
    )
    run_episode(environment, baseline)
    assert controller.found is not None
    np.testing.assert_array_equal(controller.found.error[:, 0], environment.episode_summary()["angle_error"])


def test_a_trial_is_searched_alike_in_any_company(search: tuple[SearchController, dict[str, np.ndarray]]) -> None:
    """One reference alone finds what it finds beside others; another seed finds something else."""
    alone, summary = searched([2])
    assert alone.found is not None and search[0].found is not None
    np.testing.assert_array_equal(alone.found.offsets, search[0].found.offsets[2:])
    np.testing.assert_array_equal(summary["final_angle"], search[1]["final_angle"][2:])
    other, _ = searched([2], seed=1)
    assert other.found is not None
    assert (other.found.offsets != alone.found.offsets).any() or not alone.found.offsets.any()


def test_a_search_that_is_content_stops() -> None:
    """Where the controller itself does well enough nothing else is tried, and the curve stays where it is."""
    objective = Objective(within={"final_angle": (-np.inf, np.inf)}, weights={}, error="angle_error")
    controller, summary = searched([0, 1], objectives=[objective])
    found = controller.found
    assert found is not None and found.rollouts.tolist() == [1, 1] and not found.offsets.any()
    assert found.success.all() and found.success.shape == (2, 6)
    np.testing.assert_array_equal(found.error, np.repeat(summary["angle_error"][:, None], 6, axis=1))
    choosy = replace(objective, enough={"final_angle": (-np.inf, -1.0)})
    assert objective.success(summary).all() and not choosy.content(summary).any()


LIFT = Objective(within={"lift": (1.0, 2.0)}, weights={"mean_position_error": -1.0}, error="position_error")


def test_every_decision_of_an_episode_is_searched() -> None:
    """The first in the phases before the second, which is then sought with the best of the first."""
    references = [box_references()]
    action = replace(PD_IK, synergy=SynergyConfig(press=0.02), residual=None)
    phases = (
        PhaseConfig("close", 25, action=action),
        PhaseConfig("keep", 5, decides=False, action=action),
        PhaseConfig("between", 5, action=PD_IK),
        PhaseConfig("again", 25, action=action),
    )
    assert [len(phases_until(phases, count)) for count in (1, 2)] == [3, 4]
    task = replace(get_task("both-free"), action=action, episode_steps=300)
    controller = SearchController(
        ZeroController(task), CrossEntropySettings(rollouts=6, population=4), objectives=[LIFT, LIFT]
    )
    environment = Environment(
        task,
        references,
        planned_worlds(references, [0, 0], [0, 1], 1.0),
        sequence=phases,
        noise=False,
        simulator=TWO_THREADS,
    )
    decided: list[np.ndarray] = []
    run_episode(
        environment, controller, on_step=lambda step: decided.append(environment._acting.synergy.numpy().copy())
    )
    found = controller.found
    assert found is not None and found.offsets.shape == (2, 2, 2, 13) and found.rollouts.tolist() == [6, 6]
    assert not found.success.any() and np.isfinite(found.error).all()
    columns = [*range(12), 13]
    for step, expected in ((10, found.offsets[:, 0]), (28, found.offsets[:, 0]), (33, 0.0), (50, found.offsets[:, 1])):
        np.testing.assert_array_equal(decided[step][..., columns], expected + np.zeros((2, 2, 13), np.float32))
    np.testing.assert_array_equal(found.error[:, -1], environment.episode_summary()["position_error"])


def test_offsets_join_any_action() -> None:
    """They stand in the synergies' columns, before a residual and on top of a policy's own."""
    features = np.zeros((2, 1, FEATURE_COUNT), np.float32)
    for name, size in (("right-fixed", 65), ("right-fixed-synergy", 12)):
        controller = SearchController(ZeroController(get_task(name)), SETTINGS)
        assert controller.name == "zero+search"
        with pytest.raises(RuntimeError, match="plan before"):
            controller.act(features)
        task = with_offsets(get_task(name))
        assert task.action.synergy is not None and task.action.synergy.decision_interval == 300
        assert with_offsets(task) == task == controller.task
        assert len(task.action.terms) == (2 if size == 65 else 1)
