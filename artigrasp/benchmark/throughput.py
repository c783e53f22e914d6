"""Control steps per second of an environment, stage by stage, as ratios to its bare physics."""

import math
import os
import statistics
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from artigrasp.benchmark.kernel_shares import TimeShare, device_time_shares, time_shares
from artigrasp.benchmark.memory import forget_peak, peak_memory_mb
from artigrasp.benchmark.recorded_states import RecordedStates
from artigrasp.benchmark.stages import Restore, RestoredVecEnv, TimedStep, environment_steps, threaded_loop
from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.training.runner import Runner

STAGES = ("physics", "torques", "environment", "resets", "rollout", "training")
"""Each stage does what the one before does, and more; see :func:`measure_throughput`."""

STATE_COUNT = 20
"""Recorded states."""

MJWARP_WORLDS = 64
"""Worlds up to which MuJoCo Warp is measured beside the CPU backend: more make it no faster there."""

PARTS = 4
"""Turns that each stage takes in a round."""

LONG_STEP = 0.02
"""Duration of a control step [s] from which on a turn needs no step that wakes the threads up and does not count."""

COLLECT_TURNS = 3
"""How many times longer than the other stages an iteration of PPO collects."""

ROWS_PER_BATCH = 64
"""Fewest rows in a mini-batch of PPO, if the task's iterations have as many."""


@dataclass(frozen=True)
class StageResult:
    """How fast one stage runs."""

    backend: str
    """``cpu``, ``mjwarp``, or ``mj_step`` for a hand-written loop in a thread pool."""
    device: str
    hands: int
    base: str
    """``fixed`` or ``free``."""
    worlds: int
    stage: str
    control_steps_per_s: float
    """Over all worlds, median over the rounds."""
    ratio_to_physics: float
    """Speed relative to the measured backend's physics in the same round, median over the rounds."""
    peak_memory_mb: float
    """Most memory held so far with these worlds, the stages before included."""


@dataclass(frozen=True)
class Throughput:
    """Measurements with one scene and one number of worlds."""

    stages: tuple[StageResult, ...]
    alternatives: tuple[StageResult, ...]
    """The same scene by other means, with ratios to the same physics."""
    ratio_ranges: dict[tuple[str, str], tuple[float, float]]
    """Least and largest ratio to physics of the rounds, by backend and stage."""
    learn_share: float
    """What PPO's update takes of the stage ``training``, median over the rounds."""
    shares: tuple[TimeShare, ...]
    """Where the time of the stage ``environment`` goes."""
    touching_links: float
    """Links of a hand that touch the object, on average."""


def measure_throughput(
    task: TaskConfig,
    objects: Sequence[str],
    world_count: int,
    *,
    rounds: int = 3,
    seconds: float = 0.15,
    split: str = "train",
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
    alternatives: bool = True,
    on_round: Callable[[int], None] = lambda done: None,
) -> Throughput:
    """Measure all stages in one run.

    ============= =====================================================================================
    physics       all substeps with torques held: one MuJoCo call per scene, or one replay of MuJoCo Warp
    torques       PD torques at every substep, state and contact forces read back
    environment   targets, torques, kinematics, rewards and metrics of a control step, then its features
    resets        the same, and what it takes to begin every world anew once per episode
    rollout       a PPO iteration's collection: policy, environment, adapter, storage, returns, resets
    training      a PPO iteration: collection and update
    ============= =====================================================================================

    In every round the stages take several turns, so that all of them meet the same load of the machine; a first round
    warms up and does not count. Where other programs use the cores too, only the ratios mean something, and those with
    a wide range mean little.

    What is the same in all stages: threads, models and the states from which control steps start, see
    :class:`RecordedStates`, with one exception: a decision that holds for many control steps starts from a recorded
    state and goes on from there. Putting a state back is not timed. What differs: within a control step, ``physics``
    holds the last substep's torques, the others compute them anew from the state; ``environment`` acts by the task's
    prior alone, which gives the targets of ``torques``; ``rollout`` and ``training`` add the noise of exploration, and
    an iteration is as long as the time allows, at most as long as the task's.

    Args:
        task: What is simulated and learned; its number of worlds is replaced.
        objects: Names of the objects.
        world_count: Worlds.
        rounds: Rounds to measure.
        seconds: About how long each stage is measured in a round [s]; PPO collects longer.
        split: Split whose references are played.
        seed: Seed of the environment and the learner.
        simulator: Backend, device and threads.
        alternatives: Whether to measure, beside the CPU backend, `mj_step` in a thread pool and MuJoCo Warp.
        on_round: Called with the rounds done, for progress; the first one is warming up.

    Raises:
        UserError: As for :func:`make_environment`.
    """
    forget_peak()
    task = replace(task, world_count=world_count)
    states = RecordedStates(task, objects, split=split, seed=seed, count=STATE_COUNT, threads=simulator.threads)
    environment = make_environment(task, objects, split=split, seed=seed, simulator=simulator)
    restore = states.restorer(environment)
    own = {step.stage: _Stage(step, seconds) for step in environment_steps(environment, restore)}
    peaks = {name: stage.peak_memory_mb for name, stage in own.items()}
    peaks["resets"] = peaks["reset"]

    decision_count = _decision_count(task, COLLECT_TURNS * seconds / own["environment"].step_time)
    env = RestoredVecEnv(environment, restore, decision_count)
    # the folder is for what learn() and save() write
    runner = Runner(env, Path(), seed, simulator.threads or os.cpu_count() or 1)
    runner.iterate()
    env.pop_restore_time()
    peaks |= {"rollout": env.peak_memory_mb, "training": peak_memory_mb(environment.device)}

    others = _alternatives(environment, states, restore) if alternatives and simulator.backend == "cpu" else []
    timed = [*own.values(), *(_Stage(step, seconds) for step in others)]

    samples: dict[tuple[str, str], list[float]] = defaultdict(list)
    learn_shares = []
    for done in range(rounds + 1):
        for part in range(PARTS):
            for stage in timed:
                stage.take_turn(part)
        times = {stage.key: stage.pop_step_time() for stage in timed}
        report = runner.iterate()
        step_count = decision_count * env.decision_interval
        collected = (report.collect_time - env.pop_restore_time()) / step_count
        learned = report.learn_time / step_count

        backend = simulator.backend
        beginning = times.pop((backend, "reset")) / task.episode_steps
        times[backend, "resets"] = times[backend, "environment"] + beginning
        times[backend, "rollout"] = collected + beginning
        times[backend, "training"] = times[backend, "rollout"] + learned
        if done > 0:
            for key, value in times.items():
                samples[key].append(value)
            learn_shares.append(learned / times[backend, "training"])
        on_round(done)

    ratios = {
        key: [physics / each for physics, each in zip(samples[simulator.backend, "physics"], values, strict=True)]
        for key, values in samples.items()
    }

    def result(backend: str, stage: str, peak: float) -> StageResult:
        return StageResult(
            backend=backend,
            device=environment.device,
            hands=environment.hand_count,
            base="fixed" if task.fixed_base else "free",
            worlds=world_count,
            stage=stage,
            control_steps_per_s=world_count / statistics.median(samples[backend, stage]),
            ratio_to_physics=statistics.median(ratios[backend, stage]),
            peak_memory_mb=peak,
        )

    return Throughput(
        stages=tuple(result(simulator.backend, stage, peaks[stage]) for stage in STAGES),
        alternatives=tuple(result(*stage.key, stage.peak_memory_mb) for stage in timed[len(own) :]),
        ratio_ranges={key: (min(each), max(each)) for key, each in ratios.items()},
        learn_share=statistics.median(learn_shares),
        shares=tuple(_shares(environment, own["environment"])),
        touching_links=states.touching_links,
    )


class _Stage:
    """One stage, which takes turns with the others.

    Attributes:
        step: What is timed.
        step_time: Duration of one control step [s], roughly.
        step_count: Control steps in a round.
        peak_memory_mb: Most memory held when it had run for the first time [MiB].
    """

    def __init__(self, step: TimedStep, seconds: float) -> None:
        # the first loads kernels, the second may record them
        self.step, self.step_time = step, [step.time(index) for index in range(3)][-1]
        self.step_count = min(max(round(seconds / self.step_time), PARTS), 3 * STATE_COUNT)
        self._times: list[float] = []
        self.peak_memory_mb = peak_memory_mb(step.device)

    @property
    def key(self) -> tuple[str, str]:
        """Backend and stage."""
        return self.step.backend, self.step.stage

    def take_turn(self, part: int) -> None:
        """Time one of ``PARTS`` parts of a round's control steps, which are spread over the recorded states."""
        if self.step_time < LONG_STEP:
            self.step.time(0)
        for index in range(part, self.step_count, PARTS):
            self._times.append(self.step.time(index * STATE_COUNT // self.step_count))

    def pop_step_time(self) -> float:
        """Mean duration of a control step since the last call [s]."""
        mean = statistics.mean(self._times)
        self._times.clear()
        return mean


def _decision_count(task: TaskConfig, control_steps: float) -> int:
    """Decisions of an iteration of PPO that lasts about so many control steps, but no longer than the task's."""
    rows = task.world_count * len(task.hands)
    fewest = math.ceil(ROWS_PER_BATCH * task.ppo.mini_batches / rows)
    return min(task.ppo.steps_per_env, max(fewest, round(control_steps / task.action.decision_interval)))


def _alternatives(environment: Environment, states: RecordedStates, restore: Restore) -> list[TimedStep]:
    """The same worlds by a hand-written loop, and by MuJoCo Warp on the CPU."""
    steps = [threaded_loop(environment, restore)]
    if environment.world_count <= MJWARP_WORLDS:
        mjwarp = Environment(
            environment.task,
            environment.references,
            environment.worlds,
            seed=environment.seed,
            simulator=SimulatorConfig("mjwarp", environment.device),
        )
        measured = environment_steps(mjwarp, states.restorer(mjwarp))
        steps += [step for step in measured if step.stage in ("physics", "environment")]
    return steps


def _shares(environment: Environment, stage: _Stage) -> list[TimeShare]:
    """Where the time of a control step goes; unknown for MuJoCo Warp on the CPU, whose launches are replayed."""
    simulation, step = environment.simulation, stage.step
    if isinstance(simulation, NewtonSimulation):
        on_gpu = torch.device(simulation.device).type == "cuda"
        return device_time_shares(simulation, step.step, stage.step_count) if on_gpu else []
    return time_shares(step.step, stage.step_count, step.prepare)
