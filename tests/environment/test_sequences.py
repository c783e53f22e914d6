"""Episodes of several phases."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp

from artigrasp.config import ActionConfig, PDGain, PDGains, PhaseConfig, SimulatorConfig, SynergyConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import planned_worlds
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.phases import OUTCOMES
from artigrasp.tasks import get_task
from tests.environment.examples import play
from tests.example_references import box_references

TASK = replace(get_task("both-free"), episode_steps=20)
REACH = ActionConfig(wrist_prior="hinge", finger_prior="reference", residual=None, approach_steps=10)
CARRY = ActionConfig(wrist_prior="transport", finger_prior="closed", residual=None)
STIFFER = PDGains(wrist_translation=PDGain(60.0, 1.0))


def sequence_environment(*phases: PhaseConfig, backend: Any = "cpu", **options: Any) -> Environment:
    """Two worlds, whose objects are wanted 0.2 m higher; the second reference is the other one."""
    references = [box_references()]
    offset = np.tile([0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0], (2, 1))
    worlds = planned_worlds(references, [0, 0], [0, 2], 0.8, second_reference=[2, 1], target_offset=offset)
    simulator = SimulatorConfig(backend=backend, threads=2 if backend == "cpu" else None)
    environment = Environment(TASK, references, worlds, sequence=phases, noise=False, simulator=simulator, **options)
    environment.reset()
    return environment


def no_actions(environment: Environment, count: int) -> np.ndarray:
    """Zeros for so many control steps."""
    return np.zeros((count, environment.world_count, environment.hand_count, max(environment.action_count, 1)))


@pytest.mark.parametrize("backend", ["cpu", "mjwarp"])
def test_nothing_moves_when_a_phase_begins(backend: str) -> None:
    """Bases go to where the wrists are, in the physics too; the world and its motion stay, goal and gains change."""
    first = PhaseConfig("reach", 6, action=REACH)
    environment = sequence_environment(
        first, PhaseConfig("carry", 9, carries=True, reference="second", action=CARRY, gains=STIFFER), backend=backend
    )
    play(environment, no_actions(environment, 6))
    hands, objects = environment.state.hands, environment.state.objects
    assert environment.phase.index.numpy().tolist() == [1, 1] and environment.phase.step.numpy().tolist() == [0, 0]
    assert not hands.joint_q.numpy()[..., :6].any() and np.abs(hands.joint_qd.numpy()[..., :3]).max() > 0.01
    links, pose = hands.link_pose.numpy().copy(), objects.pose.numpy().copy()
    wp.launch(forward_kinematics, dim=(2, 2), inputs=[hands, environment._hand_model], device=environment.device)
    np.testing.assert_allclose(hands.link_pose.numpy()[..., :3], links[..., :3], atol=1e-5)
    np.testing.assert_allclose(environment.goal.object_pose.numpy()[:, 2], 0.2, atol=1e-6)
    np.testing.assert_allclose(environment.stiffness.numpy()[..., 0], 60.0)
    references = environment.references[0]
    np.testing.assert_allclose(
        environment.goal.wrist_pose_in_part.numpy(), references.wrist_pose_in_part[[2, 1]], atol=1e-6
    )
    np.testing.assert_array_equal(environment.reference_rows(), [2, 1])
    speed = np.abs(hands.joint_qd.numpy()[..., :3]).max()
    play(environment, no_actions(environment, 1))
    moved = np.abs(hands.link_pose.numpy()[..., 0, :3] - links[..., 0, :3]).max()
    assert 0.0 < moved < 0.01 * speed + 1e-3, "the physics begins the phase where the state says"
    np.testing.assert_allclose(objects.pose.numpy(), pose, atol=2e-3)


def test_worlds_change_phases_each_at_its_time() -> None:
    """A world whose wrists arrive goes on; one whose do not stays; what became of phases is kept until a reset."""
    environment = sequence_environment(
        PhaseConfig("rest", 40, aim="hands", action=replace(REACH, approach_steps=1000)), PhaseConfig("next", 5)
    )
    base = environment.state.hands.joint_q.numpy()
    base[1, 0, 0] = 0.1  # away from its target, which the soft wrist does not reach in time
    environment.state.hands.joint_q.assign(base)
    environment.simulation.write_state(wp.ones(2, dtype=int, device=environment.device))
    play(environment, no_actions(environment, 12))
    assert environment.phase.index.numpy().tolist() == [1, 0]
    outcomes = [[OUTCOMES[code] for code in row] for row in environment.phase_outcome.numpy()]
    assert outcomes == [["done", "running"], ["running", "not begun"]]
    assert environment.phase.step.numpy()[0] < 12
    environment.reset()
    assert not environment.phase_outcome.numpy().any() and not environment.phase.index.numpy().any()


def test_decisions_of_a_phase_end_with_it() -> None:
    """A synergy moves the fingers in its phase, holds on where nothing is decided, and is gone without the term."""
    decided = replace(REACH, synergy=SynergyConfig(decision_interval=3))
    environment = sequence_environment(
        PhaseConfig("decide", 3, action=decided),
        PhaseConfig("keep", 3, action=decided, decides=False),
        PhaseConfig("without", 3, action=REACH),
    )
    assert environment.action_count == 12 and environment.episode_steps == 9
    action = no_actions(environment, 1)
    action[..., 6] = 1.0
    shifts = []
    for step in range(9):
        play(environment, action if step < 3 else 0 * action)
        shifts.append(environment._acting.synergy.numpy()[0, 1, 6])
    assert shifts == [1.0] * 6 + [0.0] * 3


def test_a_decision_for_a_whole_phase_holds_after_the_last() -> None:
    """A hand that has opened its object and waits for those of other worlds is not asked again."""
    decided = replace(REACH, synergy=SynergyConfig(decision_interval=3))
    environment = sequence_environment(PhaseConfig("reach", 2), PhaseConfig("decide", 3, action=decided))
    shifts = []
    for step in range(12):
        play(environment, np.full_like(no_actions(environment, 1), step))
        shifts.append(environment._acting.synergy.numpy()[0, 1, 6])
    assert environment.phase.finished.numpy().all() and shifts == [0.0] * 2 + [2.0] * 10


def test_an_episode_of_a_rollout_has_all_phases() -> None:
    """The rollout goes on until the last phase must have ended."""
    environment = sequence_environment(PhaseConfig("a", 7), PhaseConfig("b", 4))
    steps: list[int] = []
    run_episode(environment, pd_ik_controller(TASK), steps.append)
    assert steps == list(range(12))
    assert environment.phase.finished.numpy().tolist() == [1, 1]


def test_a_copy_has_the_same_phases() -> None:
    """A search tries what will be played."""
    environment = sequence_environment(PhaseConfig("a", 7), PhaseConfig("b", 4), retry_count=1)
    copy = environment.repeat(2)
    assert (copy.phases, copy.episode_steps, copy.world_count) == (environment.phases, 22, 4)
    np.testing.assert_array_equal(copy.worlds.second_reference, np.repeat(environment.worlds.second_reference, 2))
    copy.reset()
    np.testing.assert_allclose(copy.goal.target_object_pose.numpy()[:, 2], 0.2, atol=1e-6)


def test_an_episode_with_tries_left_ends_when_all_is_done() -> None:
    """Time for tries that nobody needs is not played."""
    environment = sequence_environment(PhaseConfig("a", 7), PhaseConfig("b", 4), retry_count=3)
    steps: list[int] = []
    run_episode(environment, pd_ik_controller(TASK), steps.append)
    assert environment.episode_steps == 44 and steps == list(range(12))
