"""`artigrasp train`: PPO on a task, into a run folder that can be resumed."""

import logging
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.errors import UserError

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Options:
    """Train a policy on a task.

    The run folder runs/TASK/TIME gets run.json, learning_curve.csv and .png, TensorBoard events, latest.pt (to resume
    from) and policy.pt (to act with); all of them are kept up to date while training goes on.

    With --json: {"folder": run folder, "policy": file, "iterations", "control_steps", "wall_time", "success"}.
    """

    task: Annotated[str, tyro.conf.Positional]
    """Task, see `artigrasp list tasks`."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects to train on, see `artigrasp list objects`."""
    split: str = "train"
    """Split whose references are played."""
    iterations: int | None = None
    """PPO iterations in total; by default the task's."""
    worlds: int | None = None
    """Worlds simulated at once; by default the task's."""
    seed: int = 0
    """Seed of weights, exploration, noise and goals."""
    threads: int | None = None
    """Threads of the physics; by default one per core."""
    out: Path = Path("runs")
    """Folder of the run folders."""
    resume: Path | None = None
    """Run folder to continue; it brings its own worlds, and its task, objects and seed must be those given here."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Train."""
    from artigrasp.tasks import get_task

    task = get_task(options.task)
    for name in ("iterations", "worlds", "threads"):
        value = getattr(options, name)
        if value is not None and value < 1:
            raise UserError(f"{name}: expected a positive number, found {value}")
    task = replace(
        task,
        iterations=task.iterations if options.iterations is None else options.iterations,
        world_count=task.world_count if options.worlds is None else options.worlds,
    )

    start_warp()

    import torch

    from artigrasp.environment.make import make_environment
    from artigrasp.training.run_folder import CurvePoint, new_run_folder, read_curve, write_curve, write_run_description
    from artigrasp.training.runner import LATEST, IterationReport, Runner
    from artigrasp.training.vec_env import HandVecEnv

    # the physics owns the cores; a second pool of threads would only disturb it
    torch.set_num_threads(1)
    threads = options.threads or os.cpu_count() or 1
    environment = make_environment(task, options.objects, split=options.split, seed=options.seed, thread_count=threads)
    folder = options.resume or new_run_folder(options.out, task)
    runner = Runner(HandVecEnv(environment), folder, options.seed)
    points = []
    if options.resume is not None:
        runner.resume(options.resume / LATEST)
        points = [point for point in read_curve(folder) if point.iteration <= runner.iteration]
        logger.info("resuming %s after iteration %d", folder, runner.iteration)
    write_run_description(folder, task, options.objects, options.split, options.seed, threads)
    logger.info("training %s on %s in %s", task.name, ", ".join(options.objects), folder)

    with progress_bar("Training", hidden=options.json) as progress:

        def report_iteration(report: IterationReport) -> None:
            success, error = (report.metrics.get(f"Episode/{name}", 0.0) for name in ("success", "angle_error"))
            points.append(CurvePoint(report.iteration, report.control_steps, report.wall_time, success, error))
            write_curve(folder, points, f"{task.name} on {', '.join(options.objects)}")
            progress(f"success {success:.2f}, error {error:.2f} rad", report.iteration, task.iterations)

        runner.learn(task.iterations, report_iteration)
    result = {
        "folder": str(folder),
        "policy": str(folder / "policy.pt"),
        "iterations": runner.iteration,
        "control_steps": runner.control_steps,
        "wall_time": runner.wall_time,
        "success": points[-1].success if points else 0.0,
    }
    if options.json:
        show_json(result)
    else:
        show(
            f"{runner.iteration} iterations, {runner.control_steps} control steps, {runner.wall_time / 60:.1f} min: "
            f"success while exploring {result['success']:.2f}"
        )
        show(f"policy: {result['policy']}")
    return 0
