"""Environments that the tests share the making of."""

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.kernels import states
from artigrasp.tasks import get_task
from tests.example_references import box_references

TWO_THREADS = SimulatorConfig(threads=2)


def task_of(name: str = "right-fixed", **changes: Any) -> TaskConfig:
    """A task of the project with some changes."""
    return replace(get_task(name), **changes)


def box_environment(task: TaskConfig, world_count: int = 6, **options: Any) -> Environment:
    """Worlds of a task on the train references of the lidded box, not reset yet."""
    references = [box_references().select(split="train")]
    options = {"simulator": TWO_THREADS} | options
    return Environment(task, references, training_worlds(references, world_count), **options)


def random_actions(environment: Environment, step_count: int, seed: int = 0) -> np.ndarray:
    """Standard normal actions, shape [step, W, H, action]."""
    shape = (step_count, environment.world_count, environment.hand_count, environment.action_count)
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


def play(environment: Environment, actions: np.ndarray) -> None:
    """Step once per action."""
    for action in actions:
        environment.step(wp.array(action, dtype=float, device=environment.device))


def snapshot(environment: Environment) -> dict[str, np.ndarray]:
    """Copies of everything that a policy or a measurement can see, by name, each of shape [W, ...]."""
    groups = [
        (environment.state.hands, states.HandState),
        (environment.state.objects, states.ObjectState),
        (environment.goal, states.Goal),
    ]
    arrays = {name: getattr(group, name) for group, kind in groups for name in states.element_types(kind)}
    arrays |= {"features": environment.observe(), "reward": environment.reward, "target": environment.target}
    return {name: array.numpy().copy() for name, array in arrays.items()} | environment.episode_summary()


def assert_same(found: dict[str, np.ndarray], expected: dict[str, np.ndarray], worlds: Any = slice(None)) -> None:
    """Snapshots agree bit for bit in some worlds."""
    for name, array in expected.items():
        np.testing.assert_array_equal(found[name][worlds], array[worlds], err_msg=name)
