"""Runs from their descriptions: one task, or the stages of a curriculum one after the other."""

import logging
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from artigrasp.config import SimulatorConfig
from artigrasp.training.evaluation import EvaluationPoint, PeriodicEvaluation
from artigrasp.training.learning_curve import CurvePoint
from artigrasp.training.make import make_training_environment
from artigrasp.training.processes import ALONE, Processes
from artigrasp.training.run_folder import CurriculumDescription, RunDescription, write_run_description
from artigrasp.training.runner import CHECKPOINT, POLICY, IterationReport, Runner
from artigrasp.training.vec_env import HandVecEnv

logger = logging.getLogger(__name__)

OnIteration = Callable[[IterationReport, Runner], None]


@dataclass(frozen=True)
class RunResult:
    """How a run ended."""

    folder: Path
    iterations: int
    control_steps: int
    wall_time: float
    """Training time of the whole run [s]."""
    cpu_time: float
    """Processor time of that [s]."""
    learn_share: float | None
    """What PPO's updates took of this call's time; None if none was made."""
    curve: Sequence[CurvePoint]
    evaluations: Sequence[EvaluationPoint]
    failures: dict[str, int]
    """Episodes that were cut short, by what failed, in this call and process."""

    @property
    def policy(self) -> Path:
        """File of the policy."""
        return self.folder / POLICY


def train_run(
    run: RunDescription,
    folder: Path,
    *,
    starts: Sequence[Path] = (),
    simulator: SimulatorConfig = SimulatorConfig(),
    processes: Processes = ALONE,
    on_iteration: OnIteration = lambda report, runner: None,
) -> RunResult:
    """Train a task in a run folder, or go on where its checkpoint was.

    Args:
        run: What is trained on what; its worlds are shared between the processes.
        folder: Run folder.
        starts: Policy files or checkpoints whose networks a new run begins with; of two with one network the later.
        simulator: Backend, device and threads.
        processes: Those that train together.
        on_iteration: Called after each iteration.

    Raises:
        UserError: An object or a file is missing or unfit, or the worlds do not divide between the processes.
        TrainingFailedError: A weight is no number any more.
    """
    simulator = replace(simulator, threads=simulator.threads or os.cpu_count() or 1)
    task = replace(run.task, world_count=processes.share(run.task.world_count))
    seed = processes.own_seed(run.seed)
    environment = make_training_environment(task, run.objects, split=run.split, seed=seed, simulator=simulator)
    evaluation = None
    if task.ppo.evaluation_interval:
        split = run.evaluation_split or run.split
        evaluation = PeriodicEvaluation(run.objects, split, task.ppo.evaluation_trials, simulator)
    runner = Runner(
        HandVecEnv(environment), folder, run.seed, simulator.threads or 1, evaluation=evaluation, processes=processes
    )
    if (folder / CHECKPOINT).is_file():
        runner.resume()
        logger.info("resuming after iteration %d", runner.iteration)
    else:
        for start in starts:
            runner.start_from(start)
    if processes.is_first:
        write_run_description(folder, run, simulator)
        logger.info("training %s on %s in %s", task.name, ", ".join(run.objects), folder)

    collect_time = learn_time = 0.0

    def report_iteration(report: IterationReport) -> None:
        nonlocal collect_time, learn_time
        collect_time, learn_time = collect_time + report.collect_time, learn_time + report.learn_time
        on_iteration(report, runner)

    runner.learn(task.iterations, report_iteration)
    total_time = collect_time + learn_time
    return RunResult(
        folder,
        runner.iteration,
        runner.control_steps,
        runner.wall_time,
        runner.cpu_time,
        learn_time / total_time if total_time else None,
        runner.curve,
        runner.evaluations,
        environment.failure_counts(),
    )


def train_curriculum(
    run: CurriculumDescription,
    folder: Path,
    *,
    simulator: SimulatorConfig = SimulatorConfig(),
    processes: Processes = ALONE,
    on_iteration: OnIteration = lambda report, runner: None,
) -> list[RunResult]:
    """Train the stages of a curriculum, each in a run folder of its own; those that are done are passed over.

    The last stage's policy becomes the folder's. For arguments and errors see :func:`train_run`.
    """
    results = []
    for index in range(len(run.curriculum.stages)):
        starts = [start / CHECKPOINT for start in run.starts(folder, index)]
        results.append(
            train_run(
                run.stage(index),
                run.stage_folder(folder, index),
                starts=starts,
                simulator=simulator,
                processes=processes,
                on_iteration=on_iteration,
            )
        )
        processes.gather(None)  # the first one has written what the next stage begins with
    if processes.is_first:
        shutil.copyfile(results[-1].policy, folder / POLICY)
    return results
