"""Controllers: what they do to a lid, and how they are found."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from artigrasp.assets.library import packaged_root
from artigrasp.controllers.controller import (
    Controller,
    PolicyController,
    ZeroController,
    d_grasp_controller,
    pd_ik_controller,
)
from artigrasp.controllers.library import CONTROLLERS, load_controller
from artigrasp.controllers.policy_file import save_policy
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.errors import UserError
from artigrasp.kernels.layout import FEATURE_COUNT
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.tasks import get_task
from tests.controllers.examples import example_policy
from tests.environment.examples import TWO_THREADS
from tests.example_references import box_references

PAPER, SYNERGY = get_task("right-fixed"), get_task("right-fixed-synergy")


def final_angles(controller: Controller, references: ReferenceSet) -> np.ndarray:
    """Hinge angles after an episode toward 1 rad, one per reference."""
    worlds = trial_worlds([references], [1.0])
    environment = Environment(controller.task, [references], worlds, noise=False, simulator=TWO_THREADS)
    run_episode(environment, controller)
    summary = environment.episode_summary()
    assert not summary["failed"].any()
    return summary["final_angle"]


def test_pd_ik_opens_the_lid_and_the_papers_zero_action_does_not() -> None:
    """The baseline pulls on the hinge by itself; the paper's action without a policy waits at the lid."""
    references = box_references()
    assert (final_angles(pd_ik_controller(PAPER), references) > 0.3).all()
    np.testing.assert_allclose(final_angles(ZeroController(PAPER), references), 0.0, atol=0.05)


def test_d_grasps_wrist_goes_by_time() -> None:
    """It opens a lid that the fingers keep hold of; only the way of the wrist differs from PD+IK's."""
    controller = d_grasp_controller(PAPER)
    assert (final_angles(controller, box_references()) > 0.3).any()
    action = replace(controller.task.action, wrist_prior="hinge", lead_end=pd_ik_controller(PAPER).task.action.lead_end)
    assert replace(controller.task, action=action) == pd_ik_controller(PAPER).task and controller.name == "d-grasp"


def test_what_is_shipped_works(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """On the test references of the lidded box the shipped policy opens more than PD+IK, and zero action nothing."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    references = load_references("lidded-box").select(split="test", kind="articulate")
    policy = load_controller("policy", task=PAPER, policy=packaged_root() / "policies" / "lidded-box.pt")
    opened = {
        controller.name: (final_angles(controller, references) > 0.3).mean()
        for controller in (policy, pd_ik_controller(policy.task), ZeroController(PAPER))
    }
    assert opened["policy"] > 0.7 and opened["policy"] > opened["pd-ik"] > 0.0 and opened["zero"] == 0.0
    assert policy.hand == references.hand


def test_they_do_so_on_arctic(arctic_assets: Path) -> None:
    """On the ARCTIC box PD+IK opens some of the test references, and zero action none."""
    references = load_references("box").select(split="test", kind="articulate")
    assert (final_angles(pd_ik_controller(PAPER), references) > 0.3).mean() > 0.2
    assert (final_angles(ZeroController(PAPER), references) < 0.3).all()


def test_pd_ik_keeps_the_scene(tmp_path: Path) -> None:
    """Only the action differs from the task's, and there is nothing to decide."""
    baseline = pd_ik_controller(SYNERGY)
    assert replace(baseline.task, action=SYNERGY.action) == SYNERGY
    assert baseline.name == "pd-ik"
    assert baseline.act(np.zeros((4, 1, FEATURE_COUNT), np.float32)).shape == (4, 1, 0)


@pytest.mark.parametrize(("task", "columns"), [(PAPER, 51), (SYNERGY, 12)])
def test_zero_is_zero_in_the_tasks_shape(task: object, columns: int) -> None:
    """One row per world and hand."""
    action = ZeroController(task).act(np.ones((5, 2, FEATURE_COUNT), np.float32))
    assert action.shape == (5, 2, columns) and not action.any()


def test_a_policy_acts_by_its_mean() -> None:
    """The same features give the same actions, row by row what the network says."""
    policy = example_policy(SYNERGY)
    controller = PolicyController(policy)
    features = np.random.default_rng(0).normal(size=(5, 1, FEATURE_COUNT)).astype(np.float32)
    actions = controller.act(features)
    assert actions.shape == (5, 1, 12) and actions.dtype == np.float32 and actions.any()
    np.testing.assert_array_equal(controller.act(features), actions)
    np.testing.assert_allclose(controller.act(features[3:4]), actions[3:4], atol=1e-6)
    # two hidden layers by hand; the normaliser has seen nothing yet
    state = {
        name: value.double().numpy() for name, value in policy.actors["right"].items() if value.is_floating_point()
    }
    layers = [(state[f"mlp.{layer}.weight"], state[f"mlp.{layer}.bias"]) for layer in (0, 2, 4)]
    hidden = features.astype(np.float64) / (1.0 + 1e-2)
    for weight, bias in layers[:-1]:
        hidden = hidden @ weight.T + bias
        hidden = np.where(hidden > 0.0, hidden, 0.01 * hidden)
    np.testing.assert_allclose(actions, hidden @ layers[-1][0].T + layers[-1][1], atol=1e-5)


class Recorder(ZeroController):
    """Zero action that keeps what it saw."""

    def act(self, features: np.ndarray) -> np.ndarray:
        """Zeros."""
        seen.append(features.copy())
        return super().act(features)


seen: list[np.ndarray] = []


def test_an_episode_asks_when_a_decision_is_due() -> None:
    """The controller sees fresh features once per decision, the callback every control step and the start."""
    action = replace(SYNERGY.action, synergy=replace(SYNERGY.action.synergy, decision_interval=10))
    task = replace(SYNERGY, episode_steps=30, action=action)
    references = [box_references()]
    environment = Environment(task, references, trial_worlds(references, [1.0]), noise=False, simulator=TWO_THREADS)
    seen.clear()
    steps: list[int] = []
    run_episode(environment, Recorder(task), steps.append)
    assert steps == list(range(31))
    assert len(seen) == 3 and (seen[0] != seen[1]).any() and (seen[1] != seen[2]).any()


def test_another_hand_than_the_policys_is_told(caplog: pytest.LogCaptureFixture) -> None:
    """A policy may play another hand than its own, but not in silence."""
    task = replace(PAPER, episode_steps=1)
    references = [box_references()]
    environment = Environment(task, references, trial_worlds(references, [1.0]), simulator=TWO_THREADS)
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        run_episode(environment, PolicyController(example_policy(task)))
        assert not caplog.messages
        run_episode(environment, PolicyController(example_policy(task, hand="mano")))
    assert caplog.messages == ["the policy was trained with the hand 'mano', not with 'open'"]


def test_controllers_are_found_by_name(tmp_path: Path) -> None:
    """Every name gives a controller that calls itself so; a policy brings its own task."""
    path = tmp_path / "policy.pt"
    save_policy(example_policy(SYNERGY), path)
    for name in CONTROLLERS:
        controller = load_controller(name, task=PAPER, policy=path)
        assert controller.name == name
        assert controller.task.name == (SYNERGY.name if name == "policy" else PAPER.name)
    with pytest.raises(UserError, match="unknown controller 'pdik': did you mean 'pd-ik'"):
        load_controller("pdik", task=PAPER)
    with pytest.raises(UserError, match="'policy' needs a policy file"):
        load_controller("policy", task=PAPER)


def test_loading_leaves_the_random_numbers_alone(tmp_path: Path) -> None:
    """A policy that is loaded in the middle of something does not change what is drawn next."""
    path = tmp_path / "policy.pt"
    save_policy(example_policy(SYNERGY), path)
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    load_controller("policy", task=PAPER, policy=path)
    assert torch.equal(torch.rand(3), expected)
