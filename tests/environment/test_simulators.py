"""What an environment does does not depend on how its control steps are cut up or replayed."""

import contextlib

import numpy as np
import warp as wp

from artigrasp.config import SimulatorConfig
from artigrasp.simulation.newton import NewtonSimulation
from tests.environment.examples import assert_same, box_environment, play, random_actions, snapshot, task_of


def test_threads_change_nothing() -> None:
    """One thread or several, whose blocks of worlds differ in size: bit for bit the same, failures included."""
    task = task_of(episode_steps=20)
    ends, failures, blocks = [], [], []
    for threads in (1, 2, 4):
        environment = box_environment(task, 6, simulator=SimulatorConfig(threads=threads))
        blocks.append(len(environment.simulation.torque_rows))
        environment.reset()
        play(environment, random_actions(environment, 10))
        speed = environment.state.hands.joint_qd.numpy().copy()
        speed[[0, 5], 0, 20] = np.nan
        environment.state.hands.joint_qd.assign(speed)
        environment.simulation.write_state(wp.full(6, 1, dtype=int, device=environment.device))
        play(environment, random_actions(environment, 10, seed=1))
        ends.append(snapshot(environment))
        failures.append(environment.failure_counts())
    assert blocks[0] < blocks[1] < blocks[2]
    for end in ends[1:]:
        assert_same(end, ends[0])
    assert sum(failures[0].values()) > 0 and failures[0] == failures[1] == failures[2]


def test_a_replayed_control_step_is_the_step() -> None:
    """Targets, rewards and metrics are replayed with the physics; actions reach them, resets in between are kept."""
    task = task_of(episode_steps=20)
    ends = []
    for replayed in (True, False):
        environment = box_environment(task, 2, simulator=SimulatorConfig("mjwarp", "cpu"))
        assert isinstance(environment.simulation, NewtonSimulation)
        with contextlib.nullcontext() if replayed else environment.simulation.without_replay():
            environment.reset()
            play(environment, random_actions(environment, 6))
            environment.reset()
            play(environment, random_actions(environment, 6, seed=1))
        ends.append(snapshot(environment))
    assert_same(*ends)
    assert np.abs(ends[0]["reward"]).min() > 0
