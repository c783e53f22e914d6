"""`artigrasp train`: PPO on a task or a curriculum, into a run folder that can be resumed."""

import contextlib
import logging
import signal
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import CurriculumConfig, SimulatorConfig, TaskConfig
from artigrasp.errors import UserError

if TYPE_CHECKING:
    from artigrasp.training.run_folder import CurriculumDescription
    from artigrasp.training.train import RunResult

logger = logging.getLogger(__name__)

DEFAULT_OBJECTS = ("lidded-box",)


@dataclass(frozen=True)
class Options:
    """Train a policy on a task, or on the stages of a curriculum one after the other.

    The run folder runs/TASK/TIME gets run.json, learning_curve.csv and .png, TensorBoard events, latest.pt (to resume
    from), policy.pt (to act with) and, with evaluations, evaluations.csv and best.pt; all of them are kept up to date
    while training goes on. That of a curriculum gets curriculum.json, a run folder for each stage and policy.pt.
    Started by torchrun, several processes train together.

    With --json: {"folder": run folder, "policy": file, "iterations", "control_steps", "wall_time" and "cpu_time" in
    seconds, "learn_share": what PPO's updates took of this call's time, null if none was made, "success": of the last
    articulations while exploring, null if none ended, "failures": {name: episodes cut short}, "stages": the same for
    each stage}; of a curriculum these are the sums over its stages, and success is the last one's.
    """

    task: Annotated[str, tyro.conf.Positional]
    """Task or curriculum, see `artigrasp list tasks`."""
    objects: tuple[str, ...] | None = None
    """Objects to train on, see `artigrasp list objects`; by default those of the curriculum, else lidded-box. One that
    is named twice gets twice as many worlds."""
    split: str | None = None
    """Split whose references are played; by default train."""
    iterations: tuple[int, ...] | None = None
    """PPO iterations in total; by default the task's. Of a curriculum, those of each stage, or one for all."""
    worlds: int | None = None
    """Worlds simulated at once, of all processes together; by default the task's."""
    seed: int | None = None
    """Seed of weights, exploration, noise and goals; by default 0."""
    start_from: Path | None = None
    """Policy file or checkpoint whose networks to begin with."""
    evaluate_every: int | None = None
    """Iterations between evaluations of the policy without exploration, 0 for none; by default the task's."""
    evaluation_split: str | None = None
    """Split that evaluations play; by default that of the training. best.pt is chosen by it: what is measured on it
    later is no test."""
    out: Path = Path("runs")
    """Folder of the run folders."""
    resume: Path | None = None
    """Run folder to continue, up to --iterations in total; it keeps its task, objects, split, worlds and seed."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads; by default processes share the cores."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Train."""
    _check_numbers(options)
    described = describe_run(options)

    start_warp()

    from artigrasp.environment.measuring import describe_failures
    from artigrasp.training.processes import joined_processes
    from artigrasp.training.run_folder import locked, new_run_folder, write_curriculum_description
    from artigrasp.training.runner import IterationReport, Runner, TrainingFailedError
    from artigrasp.training.train import train_curriculum, train_run

    is_single = _is_single(options, described)
    with contextlib.ExitStack() as stack:
        processes, simulator = stack.enter_context(joined_processes(options.simulator))
        folder = options.resume or processes.gather(new_run_folder(options.out, described.curriculum.name))[0]
        if processes.is_first:
            stack.enter_context(locked(folder))
        stack.enter_context(_stopped_by_signals())
        hidden = options.json or not processes.is_first
        progress = stack.enter_context(progress_bar("Training", hidden=hidden))

        def report_iteration(report: IterationReport, runner: Runner) -> None:
            now = runner.curve[-1] if runner.curve else None
            status = f"success {now.success:.2f}, reward {now.reward:.1f}" if now else ""
            if failures := describe_failures(runner.env.environment.failure_counts()):
                status += f", {failures}"
            progress(status, report.iteration, runner.task.iterations)

        shared: dict[str, Any] = {"simulator": simulator, "processes": processes, "on_iteration": report_iteration}
        try:
            if is_single:
                starts = [] if options.start_from is None else [options.start_from]
                results = [train_run(described.stage(0), folder, starts=starts, **shared)]
            else:
                if processes.is_first:
                    write_curriculum_description(folder, described)
                results = train_curriculum(described, folder, **shared)
        except TrainingFailedError as error:
            logger.error("%s", error)
            return 1
        except KeyboardInterrupt:
            logger.info("stopped; go on with: artigrasp train %s --resume %s", described.curriculum.name, folder)
            raise
    if processes.is_first:
        _show_results(options.json, folder, results)
    return 0


def describe_run(options: Options) -> "CurriculumDescription":
    """What the options ask to train; a run that is resumed keeps what it was, but for the number of iterations.

    Raises:
        UserError: The task is unknown, there is no run to resume, or it differs from what is asked for.
    """
    from artigrasp.tasks import get_curriculum
    from artigrasp.training.run_folder import (
        CURRICULUM_FILE,
        RUN_FILE,
        CurriculumDescription,
        read_curriculum_description,
        read_run_description,
    )

    if options.resume is None:
        curriculum = get_curriculum(options.task)
        objects = options.objects or curriculum.objects or DEFAULT_OBJECTS
        described = CurriculumDescription(
            curriculum, objects, options.split or "train", options.seed or 0, options.evaluation_split
        )
    else:
        path = options.resume / CURRICULUM_FILE
        if path.is_file():
            described = read_curriculum_description(options.resume)
        else:
            path, single = options.resume / RUN_FILE, read_run_description(options.resume)
            curriculum = CurriculumConfig(single.task.name, single.task.description, (single.task,))
            described = CurriculumDescription(
                curriculum, single.objects, single.split, single.seed, single.evaluation_split
            )
        kept = {
            "task": described.curriculum.name,
            "objects": described.objects,
            "split": described.split,
            "seed": described.seed,
            "worlds": described.curriculum.stages[0].world_count,
        }
        for name, value in kept.items():
            asked = getattr(options, name)
            if asked is not None and asked != value:
                raise UserError(f"{path}: {name}: expected {asked!r}, found {value!r}")
    return replace(described, curriculum=_with_options(described.curriculum, options))


def _with_options(curriculum: CurriculumConfig, options: Options) -> CurriculumConfig:
    """The curriculum with the numbers that were asked for.

    Raises:
        UserError: There are neither one nor as many numbers of iterations as stages.
    """
    count = len(curriculum.stages)
    iterations = options.iterations or tuple(stage.iterations for stage in curriculum.stages)
    if len(iterations) not in (1, count):
        raise UserError(f"iterations: expected one number or one for each of {count} stages, found {len(iterations)}")

    def change(stage: TaskConfig, iterations: int) -> TaskConfig:
        interval = stage.ppo.evaluation_interval if options.evaluate_every is None else options.evaluate_every
        ppo = replace(stage.ppo, evaluation_interval=interval)
        # a stage that only gathers networks goes on doing so
        iterations = iterations if stage.iterations else 0
        return replace(stage, iterations=iterations, world_count=options.worlds or stage.world_count, ppo=ppo)

    numbers = iterations * count if len(iterations) == 1 else iterations
    stages = tuple(change(*pair) for pair in zip(curriculum.stages, numbers, strict=True))
    return replace(curriculum, stages=stages)


def _check_numbers(options: Options) -> None:
    numbers = {"worlds": (options.worlds,), "iterations": options.iterations or ()}
    for name, values in numbers.items():
        for value in values:
            if value is not None and value < 1:
                raise UserError(f"{name}: expected a positive number, found {value}")
    if options.evaluate_every is not None and options.evaluate_every < 0:
        raise UserError(f"evaluate-every: expected zero or a positive number, found {options.evaluate_every}")


def _is_single(options: Options, described: "CurriculumDescription") -> bool:
    """Whether the run folder is that of a task, and has no stages below it.

    Raises:
        UserError: A curriculum, or a run that has begun, is to start from a policy.
    """
    from artigrasp.tasks import CURRICULA

    is_single = described.curriculum.name not in CURRICULA
    if options.start_from is not None and (options.resume is not None or not is_single):
        raise UserError("start-from: expected a new run of a task, found one that is resumed or a curriculum")
    return is_single


@contextlib.contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM, which schedulers and torchrun send, stop the training as Ctrl-C does: nothing is lost."""

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _show_results(as_json: bool, folder: Path, results: "list[RunResult]") -> None:
    from artigrasp.environment.measuring import describe_failures

    stages = [
        {
            "folder": str(each.folder),
            "policy": str(each.policy),
            "iterations": each.iterations,
            "control_steps": each.control_steps,
            "wall_time": each.wall_time,
            "cpu_time": each.cpu_time,
            "learn_share": each.learn_share,
            "success": _last_success(each),
            "failures": each.failures,
        }
        for each in results
    ]
    total = dict(stages[-1])
    if len(stages) > 1:
        for name in ("iterations", "control_steps", "wall_time", "cpu_time"):
            total[name] = sum(each[name] for each in stages)  # type: ignore[misc]
        total |= {"folder": str(folder), "policy": str(folder / results[-1].policy.name)}
    if as_json:
        show_json({**total, "stages": stages})
        return
    for each in results:
        minutes = each.wall_time / 60
        name = f"{each.folder.name}: " if len(results) > 1 else ""
        show(f"{name}{each.iterations} iterations, {each.control_steps} control steps, {minutes:.1f} min")
        if each.learn_share is not None:
            show(f"learning took {each.learn_share:.0%} of the time, the rest went into collecting")
        if (success := _last_success(each)) is not None:
            show(f"success while exploring: {success:.2f}")
        if each.evaluations:
            show(f"best of {len(each.evaluations)} evaluations: {max(point.score for point in each.evaluations):.2f}")
        if failures := describe_failures(each.failures):
            show(f"episodes that were cut short: {failures}")
    show(f"policy: {total['policy']}")


def _last_success(result: "RunResult") -> float | None:
    """Success of articulation in the last iteration that shows it."""
    shown = [point.success for point in result.curve if point.success == point.success]
    return shown[-1] if shown else None
