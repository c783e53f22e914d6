"""Control steps per second of an environment, stage by stage, as ratios to its bare physics."""

import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
import warp as wp
from tensordict import TensorDict

from artigrasp.benchmark.bare_physics import BarePhysics, cpu_simulation
from artigrasp.benchmark.kernel_shares import TimeShare, time_shares
from artigrasp.benchmark.recorded_states import RecordedStates
from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.training.runner import Runner
from artigrasp.training.vec_env import HandVecEnv

STAGES = ("physics", "torques", "environment", "rollout", "training")
"""Each stage does what the one before does, and more; see :func:`measure_throughput`."""

STATE_COUNT = 20
"""Recorded states."""

TURNS = 3
"""Turns of each of the first three stages in a round. A turn goes once through the states, after a step that wakes the
threads up and does not count."""


@dataclass(frozen=True)
class StageResult:
    """How fast one stage runs."""

    backend: str
    device: str
    hands: int
    base: str
    """``fixed`` or ``free``."""
    worlds: int
    stage: str
    control_steps_per_s: float
    """Over all worlds, median over the rounds."""
    ratio_to_physics: float
    """Speed relative to the physics of the same round, median over the rounds."""
    peak_memory_mb: float
    """Most memory that the process has held so far, the stages before included."""


@dataclass(frozen=True)
class Throughput:
    """Measurements with one number of worlds."""

    stages: tuple[StageResult, ...]
    ratio_ranges: dict[str, tuple[float, float]]
    """Least and largest ratio to physics of the rounds, by stage."""
    shares: tuple[TimeShare, ...]
    """Where the time of the stage ``environment`` goes."""
    touching_links: float
    """Links of a hand that touch the object, on average."""
    thread_count: int
    """Threads of the physics."""


def measure_throughput(
    task: TaskConfig,
    objects: Sequence[str],
    world_count: int,
    *,
    rounds: int = 5,
    split: str = "train",
    seed: int = 0,
    thread_count: int | None = None,
    on_round: Callable[[int], None] = lambda done: None,
) -> Throughput:
    """Measure all stages in one run.

    ============= =====================================================================================
    physics       one MuJoCo call per scene for all substeps, torques held
    torques       PD torques at every substep, state and contact forces read back
    environment   targets, torques, kinematics, rewards and metrics of a control step, then its features
    rollout       a PPO iteration's collection: policy, environment, adapter, storage, returns
    training      a whole PPO iteration at the task's settings
    ============= =====================================================================================

    Every round is one PPO iteration; within it the other stages take turns, so that all of them meet the same load of
    the machine. A first round warms up and does not count. Where other programs use the cores too, only the ratios mean
    something, and those with a wide range mean little.

    What is the same in all stages: threads, models and the states from which control steps start, see
    :class:`RecordedStates`, with one exception: a decision that holds for many control steps starts from a recorded
    state and goes on from there. Putting a state back is not timed. What differs: within a control step, ``physics``
    holds the last substep's torques, the others compute them anew from the state; ``environment`` acts by the task's
    prior alone, which gives the targets of ``torques``; ``rollout`` and ``training`` add the noise of exploration.

    Args:
        task: What is simulated and learned; its number of worlds is replaced.
        objects: Names of the objects.
        world_count: Worlds.
        rounds: PPO iterations to measure.
        split: Split whose references are played.
        seed: Seed of the environment and the learner.
        thread_count: Threads of the physics, all cores by default.
        on_round: Called with the rounds done, for progress; the first one is warming up.

    Raises:
        UserError: As for :func:`make_environment`.
    """
    task = replace(task, world_count=world_count)
    environment = make_environment(
        task, objects, split=split, seed=seed, simulator=SimulatorConfig(threads=thread_count)
    )
    environment.reset()
    states = RecordedStates(environment, objects, split, STATE_COUNT)
    stages = _Stages(environment, states)
    peaks = stages.warm_up()
    env = _InterruptedVecEnv(environment, states, stages.take_turns)
    runner = Runner(env, Path(), seed)  # the folder is for what learn() and save() write

    seconds: list[dict[str, float]] = []
    for done in range(rounds + 1):
        report = runner.iterate()
        control_steps = task.ppo.steps_per_env * env.decision_interval
        collected = (report.collect_time - env.pop_interruption()) / control_steps
        learned = report.learn_time / control_steps
        seconds.append({**stages.pop_seconds(), "rollout": collected, "training": collected + learned})
        if done == 0:
            peaks |= {"rollout": env.peak_memory_mb, "training": peak_memory_mb()}
        on_round(done)
    del seconds[0]

    ratios = {stage: [each["physics"] / each[stage] for each in seconds] for stage in STAGES}

    def result(stage: str) -> StageResult:
        return StageResult(
            backend="cpu",
            device=environment.device,
            hands=environment.hand_count,
            base="fixed" if task.fixed_base else "free",
            worlds=world_count,
            stage=stage,
            control_steps_per_s=world_count / statistics.median(each[stage] for each in seconds),
            ratio_to_physics=statistics.median(ratios[stage]),
            peak_memory_mb=peaks[stage],
        )

    return Throughput(
        stages=tuple(result(stage) for stage in STAGES),
        ratio_ranges={stage: (min(each), max(each)) for stage, each in ratios.items()},
        shares=tuple(time_shares(stages.environment_step, 2 * STATE_COUNT, states.restore)),
        touching_links=states.touching_links,
        thread_count=stages.thread_count,
    )


def peak_memory_mb() -> float:
    """Most memory that the process has held so far [MiB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10


class _Stages:
    """The stages without a policy, taking turns."""

    def __init__(self, environment: Environment, states: RecordedStates) -> None:
        self._environment, self._states = environment, states
        simulation = cpu_simulation(environment)
        self.thread_count = simulation.thread_count
        self._physics = BarePhysics(simulation)
        shape = (environment.world_count, environment.hand_count, environment.action_count)
        self._no_action = wp.zeros(shape, dtype=float, device=environment.device)
        self._steps = {
            "physics": self._physics.step,
            "torques": lambda: simulation.step(environment.apply_torques),
            "environment": self.environment_step,
        }
        self._seconds: dict[str, list[float]] = {name: [] for name in self._steps}

    def environment_step(self) -> None:
        """A control step by the task's prior, and the features after it."""
        self._environment.step(self._no_action)
        self._environment.observe()

    def warm_up(self) -> dict[str, float]:
        """Run every stage once; the peaks of memory after each [MiB]."""
        peaks = {}
        for name, step in self._steps.items():
            self._restore(0)
            step()
            peaks[name] = peak_memory_mb()
        return peaks

    def take_turns(self) -> None:
        """Time some control steps of every stage, one stage after the other."""
        for name, step in self._steps.items():
            for index in range(STATE_COUNT + 1):
                self._restore(index)
                start = time.perf_counter()
                step()
                if index > 0:
                    self._seconds[name].append(time.perf_counter() - start)

    def pop_seconds(self) -> dict[str, float]:
        """Mean time of a control step of all worlds since the last call [s], by stage."""
        means = {name: statistics.mean(seconds) for name, seconds in self._seconds.items()}
        for seconds in self._seconds.values():
            seconds.clear()
        return means

    def _restore(self, index: int) -> None:
        self._states.restore(index)
        self._physics.hold_torques()


class _InterruptedVecEnv(HandVecEnv):
    """Starts every decision from the next recorded state, and lets something else happen before some of them.

    Attributes:
        peak_memory_mb: Most memory that the process had held when the last decision was over [MiB].
    """

    def __init__(self, environment: Environment, states: RecordedStates, interlude: Callable[[], None]) -> None:
        super().__init__(environment)
        self._states, self._interlude = states, interlude
        self._turns = min(TURNS, self.task.ppo.steps_per_env)
        self._decisions = 0
        self._interruption = 0.0
        self.peak_memory_mb = 0.0

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, torch.Tensor]]:
        start = time.perf_counter()
        if self._decisions % (self.task.ppo.steps_per_env // self._turns) == 0:
            self._interlude()
        self._states.restore(self._decisions)
        self._decisions += 1
        self._interruption += time.perf_counter() - start
        result = super().step(actions)
        self.peak_memory_mb = peak_memory_mb()
        return result

    def pop_interruption(self) -> float:
        """Time since the last call that was no collection [s]."""
        interruption, self._interruption = self._interruption, 0.0
        return interruption
