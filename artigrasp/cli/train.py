"""`artigrasp train`: PPO on a task, into a run folder that can be resumed."""

import logging
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError

if TYPE_CHECKING:
    from artigrasp.training.run_folder import RunDescription

logger = logging.getLogger(__name__)

DEFAULT_OBJECTS = ("lidded-box",)


@dataclass(frozen=True)
class Options:
    """Train a policy on a task.

    The run folder runs/TASK/TIME gets run.json, learning_curve.csv and .png, TensorBoard events, latest.pt (to resume
    from) and policy.pt (to act with); all of them are kept up to date while training goes on.

    With --json: {"folder": run folder, "policy": file, "iterations", "control_steps", "wall_time", "learn_share": what
    PPO's updates took of this call's time, null if none was made, "success": of the last episodes while exploring, null
    if none ended}.
    """

    task: Annotated[str, tyro.conf.Positional]
    """Task, see `artigrasp list tasks`."""
    objects: tuple[str, ...] | None = None
    """Objects to train on, see `artigrasp list objects`; by default lidded-box."""
    split: str | None = None
    """Split whose references are played; by default train."""
    iterations: int | None = None
    """PPO iterations in total; by default the task's."""
    worlds: int | None = None
    """Worlds simulated at once; by default the task's."""
    seed: int | None = None
    """Seed of weights, exploration, noise and goals; by default 0."""
    out: Path = Path("runs")
    """Folder of the run folders."""
    resume: Path | None = None
    """Run folder to continue, up to --iterations in total; it keeps its task, objects, split, worlds and seed."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Train."""
    for name in ("iterations", "worlds"):
        value = getattr(options, name)
        if value is not None and value < 1:
            raise UserError(f"{name}: expected a positive number, found {value}")
    described = describe_run(options)
    task = described.task

    start_warp()

    from artigrasp.environment.environment import describe_failures
    from artigrasp.environment.make import make_environment
    from artigrasp.training.run_folder import new_run_folder, write_run_description
    from artigrasp.training.runner import POLICY, IterationReport, Runner
    from artigrasp.training.vec_env import HandVecEnv

    simulator = replace(options.simulator, threads=options.simulator.threads or os.cpu_count() or 1)
    environment = make_environment(
        task, described.objects, split=described.split, seed=described.seed, simulator=simulator
    )
    folder = options.resume or new_run_folder(options.out, task)
    runner = Runner(HandVecEnv(environment), folder, described.seed, simulator.threads or 1)
    if options.resume is not None:
        runner.resume()
        logger.info("resuming after iteration %d", runner.iteration)
    write_run_description(folder, described, simulator)
    logger.info("training %s on %s in %s", task.name, ", ".join(described.objects), folder)

    reports: list[IterationReport] = []
    with progress_bar("Training", hidden=options.json) as progress:

        def report_iteration(report: IterationReport) -> None:
            reports.append(report)
            now = runner.curve[-1] if runner.curve else None
            status = f"success {now.success:.2f}, error {now.angle_error:.2f} rad" if now else ""
            if failures := describe_failures(environment.failure_counts()):
                status += f", {failures}"
            progress(status, report.iteration, task.iterations)

        runner.learn(task.iterations, report_iteration)
    learn_time = sum(report.learn_time for report in reports)
    total_time = learn_time + sum(report.collect_time for report in reports)
    result = {
        "folder": str(folder),
        "policy": str(folder / POLICY),
        "iterations": runner.iteration,
        "control_steps": runner.control_steps,
        "wall_time": runner.wall_time,
        "learn_share": learn_time / total_time if reports else None,
        "success": runner.curve[-1].success if runner.curve else None,
        "failures": environment.failure_counts(),
    }
    if options.json:
        show_json(result)
        return 0
    show(f"{runner.iteration} iterations, {runner.control_steps} control steps, {runner.wall_time / 60:.1f} min")
    if reports:
        show(f"learning took {learn_time / total_time:.0%} of the time, the rest went into collecting")
    if runner.curve:
        show(f"success while exploring: {runner.curve[-1].success:.2f}")
    if failures := describe_failures(environment.failure_counts()):
        show(f"episodes that were cut short: {failures}")
    show(f"policy: {result['policy']}")
    return 0


def describe_run(options: Options) -> "RunDescription":
    """What the options ask to train; a run that is resumed keeps what it was, but for the number of iterations.

    Raises:
        UserError: The task is unknown, there is no run to resume, or it differs from what is asked for.
    """
    from artigrasp.tasks import get_task
    from artigrasp.training.run_folder import RUN_FILE, RunDescription, read_run_description

    task = get_task(options.task)
    if options.resume is None:
        task = replace(task, world_count=options.worlds or task.world_count)
        run = RunDescription(task, options.objects or DEFAULT_OBJECTS, options.split or "train", options.seed or 0)
    else:
        run = read_run_description(options.resume)
        kept = {"task": run.task.name, "objects": run.objects, "split": run.split, "seed": run.seed}
        for name, value in {**kept, "worlds": run.task.world_count}.items():
            asked = getattr(options, name)
            if asked is not None and asked != value:
                raise UserError(f"{options.resume / RUN_FILE}: {name}: expected {asked!r}, found {value!r}")
    return replace(run, task=replace(run.task, iterations=options.iterations or run.task.iterations))
