"""What is timed: control steps with more and more around the physics, and what others would use instead."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
import warp as wp
from tensordict import TensorDict

from artigrasp.benchmark.bare_physics import BarePhysics, ThreadedLoop, bare_physics, cpu_simulation
from artigrasp.benchmark.memory import peak_memory_mb
from artigrasp.environment.environment import Environment
from artigrasp.training.vec_env import HandVecEnv

Restore = Callable[[int], None]


@dataclass(frozen=True)
class TimedStep:
    """One way to advance all worlds by a control step."""

    backend: str
    device: str
    stage: str
    prepare: Restore
    """Puts back the state of that index, not timed."""
    step: Callable[[], None]

    def time(self, index: int) -> float:
        """Seconds of one step from a state."""
        self.prepare(index)
        wp.synchronize_device(self.device)
        start = time.perf_counter()
        self.step()
        wp.synchronize_device(self.device)
        return time.perf_counter() - start


def environment_steps(environment: Environment, restore: Restore) -> list[TimedStep]:
    """Bare physics, physics with torques, a control step with features and rewards, and beginning all worlds anew."""
    simulation = environment.simulation
    physics = bare_physics(environment)
    shape = (environment.world_count, environment.hand_count, environment.action_count)
    no_action = wp.zeros(shape, dtype=float, device=environment.device)

    def control_step() -> None:
        environment.step(no_action)
        environment.observe()

    steps: dict[str, Callable[[], None]] = {
        "physics": physics.step,
        "torques": lambda: simulation.step(environment.apply_torques),
        "environment": control_step,
        "reset": environment.reset,
    }
    backend, device = environment.simulator.backend, environment.device
    prepare = _prepared(restore, physics)
    if backend == "cpu":
        return [TimedStep(backend, device, name, prepare, step) for name, step in steps.items()]
    # the solver's warm start is no part of the recorded states: a step that does not count makes one
    return [TimedStep(backend, device, name, _and_then(prepare, step), step) for name, step in steps.items()]


def threaded_loop(environment: Environment, restore: Restore) -> TimedStep:
    """`mj_step` in a thread pool, with the environment's models, worlds and threads."""
    loop = ThreadedLoop(cpu_simulation(environment))
    return TimedStep("mj_step", environment.device, "physics", _prepared(restore, loop), loop.step)


def _prepared(restore: Restore, physics: BarePhysics) -> Restore:
    def prepare(index: int) -> None:
        restore(index)
        physics.hold_torques()

    return prepare


def _and_then(prepare: Restore, step: Callable[[], None]) -> Restore:
    def prepare_and_step(index: int) -> None:
        prepare(index)
        step()

    return prepare_and_step


class RestoredVecEnv(HandVecEnv):
    """Starts every decision from the next recorded state; no episode ends before its last decision.

    Attributes:
        peak_memory_mb: Most memory that was held before the last decision [MiB].
    """

    def __init__(self, environment: Environment, restore: Restore, decision_count: int) -> None:
        """Let PPO's iterations have ``decision_count`` decisions."""
        super().__init__(environment)
        self.task = self.cfg = replace(self.task, ppo=replace(self.task.ppo, steps_per_env=decision_count))
        self._restore = restore
        self._decisions = 0
        self._restore_time = 0.0
        self.peak_memory_mb = 0.0

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, torch.Tensor]]:
        """Put the next state back, then hold the actions."""
        wp.synchronize_device(self.device)
        start = time.perf_counter()
        self._restore(self._decisions)
        self._decisions += 1
        self.episode_length_buf.zero_()
        self.peak_memory_mb = peak_memory_mb(self.device)
        wp.synchronize_device(self.device)
        self._restore_time += time.perf_counter() - start
        return super().step(actions)

    def pop_restore_time(self) -> float:
        """Time since the last call that went into putting states back [s]."""
        restore_time, self._restore_time = self._restore_time, 0.0
        return restore_time
