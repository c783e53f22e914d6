"""Whatever goes wrong with the physics of a world, on either backend: it is counted, reset, and teaches nothing."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
import torch
import warp as wp

from artigrasp.config import SimulatorConfig
from artigrasp.simulation import backend
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.training.vec_env import HandVecEnv
from tests.environment.examples import box_environment
from tests.training.examples import WORLD_COUNT, small_paper

BROKEN = 2


def spoil(env: HandVecEnv, array: wp.array, value: float, column: int = 10) -> None:
    """Put a number into a state of one world."""
    values = array.numpy().copy()
    values[BROKEN, 0, column] = value
    array.assign(values)
    mask = np.arange(WORLD_COUNT) == BROKEN
    env.environment.simulation.write_state(wp.array(mask, dtype=int, device=env.device))


INJURIES: dict[str, tuple[str, Callable[[HandVecEnv], None]]] = {
    "speed that is no number": ("diverged", lambda env: spoil(env, env.environment.state.hands.joint_qd, np.nan)),
    "endless coordinate": ("diverged", lambda env: spoil(env, env.environment.state.hands.joint_q, np.inf)),
    "runaway wrist": ("runaway", lambda env: spoil(env, env.environment.state.hands.joint_qd, 1e4, column=0)),
    "runaway coordinate": ("runaway", lambda env: spoil(env, env.environment.state.hands.joint_q, 1e5)),
}


@pytest.fixture(scope="module", params=backend.BACKENDS)
def env(request: pytest.FixtureRequest) -> HandVecEnv:
    """The paper's task, one episode of six control steps."""
    simulator = SimulatorConfig(backend=request.param, device="cpu", threads=2 if request.param == "cpu" else None)
    return HandVecEnv(box_environment(small_paper(), WORLD_COUNT, simulator=simulator))


def step(env: HandVecEnv) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Features, rewards and dones after an action of zero."""
    observations, rewards, dones, _ = env.step(torch.zeros(env.num_envs, env.num_actions))
    return observations["policy"], rewards, dones


@pytest.mark.parametrize("injury", INJURIES)
def test_a_failed_world_is_counted_and_never_learned_from(env: HandVecEnv, injury: str) -> None:
    """Its episode ends, earns nothing and shows the next one's beginning; its neighbours go on."""
    failure, injure = INJURIES[injury]
    env.restart()
    env.pop_failures()
    injure(env)
    features, rewards, dones = step(env)
    assert dones.tolist() == [int(world == BROKEN) for world in range(WORLD_COUNT)]
    assert rewards[BROKEN] == 0.0 and torch.isfinite(rewards).all()
    assert torch.isfinite(features).all() and features.abs().max() < 1e3
    assert env.pop_failures()[f"Physics/{failure}"] == 1
    assert step(env)[2].sum() == 0, "the world is sound again"
    assert not any(env.pop_failures().values())


def test_dropped_contacts_end_an_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    """A world of MuJoCo Warp whose contacts do not fit is no longer to be believed."""
    monkeypatch.setattr(backend, "NewtonSimulation", partial(NewtonSimulation, contact_capacity=4))
    simulator = SimulatorConfig(backend="mjwarp", device="cpu")
    env = HandVecEnv(box_environment(small_paper(), 1, simulator=simulator))
    base = env.environment.state.hands.hand_base
    base.assign(np.array([[[0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0]]], dtype=np.float32))  # the hand stuck in the box
    env.environment.simulation.write_state(wp.full(1, 1, dtype=int, device="cpu"))
    features, rewards, dones = step(env)
    assert dones.tolist() == [1] and rewards.tolist() == [0.0] and torch.isfinite(features).all()
    assert env.pop_failures()["Physics/overflow"] == 1
