"""`artigrasp bench`: how many control steps per second, and where the time goes."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.errors import UserError

if TYPE_CHECKING:
    from artigrasp.benchmark.throughput import Throughput


@dataclass(frozen=True)
class Options:
    """Measure throughput from bare physics to training, as ratios in one run, and the share of each kernel.

    All stages start control steps from the same states, in which the hand holds the lid: physics (one MuJoCo call per
    control step, torques held), torques (PD torques every substep), environment (targets, torques, kinematics, rewards,
    metrics, features), rollout (with the policy), training (with PPO's update at the task's settings).

    With --json: [{"backend", "device", "hands": how many, "base": "fixed" or "free", "worlds", "stage",
    "control_steps_per_s": over all worlds, "ratio_to_physics": speed over that of bare physics, "peak_memory_mb": of
    the process so far}].
    """

    task: str = "right-fixed"
    """Task, see `artigrasp list tasks`."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects, see `artigrasp list objects`."""
    split: str = "train"
    """Split whose references are played."""
    worlds: tuple[int, ...] = (64,)
    """Numbers of worlds to measure with."""
    rounds: int = 5
    """PPO iterations that are measured, with the other stages in between; one more warms up."""
    seed: int = 0
    """Seed of references, goals and exploration."""
    threads: int | None = None
    """Threads of the physics; by default one per core."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Measure and print."""
    for name, values in (("worlds", options.worlds), ("rounds", (options.rounds,)), ("threads", (options.threads,))):
        for value in values:
            if value is not None and value < 1:
                raise UserError(f"{name}: expected a positive number, found {value}")

    from artigrasp.tasks import get_task

    task = get_task(options.task)
    start_warp()

    import torch

    from artigrasp.benchmark.machine import machine_facts
    from artigrasp.benchmark.throughput import measure_throughput

    # as in training: the physics owns the cores
    torch.set_num_threads(1)
    measured = []
    # memory only ever peaks higher
    for world_count in sorted(set(options.worlds)):
        with progress_bar(f"{world_count} worlds", hidden=options.json) as progress:
            measured.append(
                measure_throughput(
                    task,
                    options.objects,
                    world_count,
                    rounds=options.rounds,
                    split=options.split,
                    seed=options.seed,
                    thread_count=options.threads,
                    on_round=lambda done: progress("", done, options.rounds),
                )
            )
    if options.json:
        show_json([asdict(stage) for each in measured for stage in each.stages])
        return 0
    show_columns([(f"{name}:", fact) for name, fact in machine_facts().items()])
    threads = measured[0].thread_count
    show(f"{task.name} on {', '.join(options.objects)}, {threads} thread{'s' * (threads > 1)} of physics")
    for each in measured:
        show()
        show_columns(_stage_rows(each))
        show()
        show_columns(_share_rows(each))
    return 0


def _stage_rows(measured: "Throughput") -> Sequence[tuple[str, ...]]:
    worlds = measured.stages[0].worlds
    rows = [(f"{worlds} worlds", "control steps/s", "ratio to physics", "of the rounds", "peak memory")]
    for stage in measured.stages:
        low, high = measured.ratio_ranges[stage.stage]
        rows.append(
            (
                f"  {stage.stage}",
                f"{stage.control_steps_per_s:.0f}",
                f"{stage.ratio_to_physics:.3f}",
                f"{low:.3f} to {high:.3f}",
                f"{stage.peak_memory_mb:.0f} MiB",
            )
        )
    return rows


def _share_rows(measured: "Throughput") -> Sequence[tuple[str, ...]]:
    head = f"environment step, {measured.touching_links:.1f} links of a hand touching"
    rows = [(head, "share", "processor time", "calls")]
    for share in measured.shares:
        rows.append((f"  {share.name}", f"{share.share:.1%}", f"{share.cpu_time * 1e3:.3f} ms", f"{share.calls:.0f}"))
    return rows
