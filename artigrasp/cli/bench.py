"""`artigrasp bench`: how many control steps per second, and where the time goes."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Literal

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError

if TYPE_CHECKING:
    from artigrasp.benchmark.throughput import StageResult, Throughput
    from artigrasp.config import TaskConfig

HANDS: dict[int, tuple[Literal["left", "right"], ...]] = {1: ("right",), 2: ("left", "right")}


@dataclass(frozen=True)
class Options:
    """Measure throughput from bare physics to training, as ratios in one run, beside what others would use.

    All stages start control steps from the same states, in which hands hold the lid: physics (one MuJoCo call per
    control step, torques held), torques (PD torques every substep), environment (targets, torques, kinematics, rewards,
    metrics, features), resets (and every world's new beginning once per episode), rollout (with the policy), training
    (with PPO's update). Beside the backend cpu, the same worlds are stepped by mj_step in a thread pool, and by MuJoCo
    Warp on the CPU, replayed from a graph. Each stage takes its turn in every round; figures are medians over rounds.

    With --json: [{"backend": "cpu", "mjwarp" or "mj_step", "device", "hands": how many, "base": "fixed" or "free",
    "worlds", "stage", "control_steps_per_s": over all worlds, "ratio_to_physics": speed over that of the measured
    backend's bare physics, "peak_memory_mb": with these worlds, up to this stage}].
    """

    task: str = "right-fixed"
    """Task whose action, rewards and learner are measured, see `artigrasp list tasks`."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects, see `artigrasp list objects`."""
    split: str = "train"
    """Split whose references are played."""
    hands: tuple[Literal[1, 2], ...] = (1, 2)
    """Numbers of hands: 1 is the right one."""
    bases: tuple[Literal["fixed", "free"], ...] = ("fixed", "free")
    """Kinds of the object's base."""
    worlds: tuple[int, ...] = (1, 4, 16, 64, 256, 1024)
    """Numbers of worlds."""
    rounds: int = 3
    """Rounds that are measured; one more warms up."""
    seconds: float = 0.15
    """About how long each stage is measured in a round [s]."""
    alternatives: Literal["on", "off"] = "on"
    """Whether to measure, beside the backend cpu, what others would use."""
    seed: int = 0
    """Seed of references, goals and exploration."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Measure and print."""
    for name in ("worlds", "rounds", "seconds"):
        values = getattr(options, name)
        for value in values if isinstance(values, tuple) else (values,):
            if not 0 < value < math.inf:
                raise UserError(f"{name}: expected a positive number, found {value}")

    from artigrasp.tasks import get_task

    tasks = _scenes(get_task(options.task), options)
    start_warp()

    import torch

    from artigrasp.benchmark.machine import machine_facts
    from artigrasp.benchmark.throughput import measure_throughput

    torch.set_num_threads(1)  # as in training: while it steps, the physics owns the cores
    world_counts = sorted(set(options.worlds))
    measured: list[list[Throughput]] = []
    if not options.json:
        show_columns([(f"{name}:", fact) for name, fact in machine_facts().items()])
        show(f"{options.task} on {', '.join(options.objects)}")
    for task in tasks:
        measured.append([])
        for count in world_counts:
            scene = f"{_scene_name(len(task.hands), task.fixed_base)}, {count} worlds"
            with progress_bar(scene, hidden=options.json) as progress:
                measured[-1].append(
                    measure_throughput(
                        task,
                        options.objects,
                        count,
                        rounds=options.rounds,
                        seconds=options.seconds,
                        split=options.split,
                        seed=options.seed,
                        simulator=options.simulator,
                        alternatives=options.alternatives == "on",
                        on_round=lambda done: progress("", done, options.rounds),
                    )
                )
        if not options.json:
            _show_scene(measured[-1])
    if options.json:
        every = [each for scene in measured for each in scene]
        show_json([asdict(stage) for each in every for stage in (*each.stages, *each.alternatives)])
    return 0


def _scenes(task: "TaskConfig", options: Options) -> "list[TaskConfig]":
    """The task with every number of hands and kind of base."""
    return [
        replace(task, hands=HANDS[hands], fixed_base=base == "fixed")
        for hands in sorted(set(options.hands))
        for base in dict.fromkeys(options.bases)
    ]


def _scene_name(hands: int, fixed_base: bool) -> str:
    return f"{hands} hand{'s' * (hands > 1)}, {'fixed' if fixed_base else 'free'} base"


def _show_scene(measured: "Sequence[Throughput]") -> None:
    """Tables of one scene: growth with the number of worlds, alternatives, and kernels."""
    first = measured[0].stages[0]
    touching = measured[-1].touching_links
    show()
    show(f"{_scene_name(first.hands, first.base == 'fixed')}: {touching:.1f} links of a hand touch the object")
    show()
    stages = [stage.stage for stage in measured[0].stages]
    rows = [("worlds", "physics, control steps/s", *stages[1:], "learning", "peak memory")]
    for each in measured:
        ratios = [_ratio(each, stage) for stage in each.stages[1:]]
        memory = f"{each.stages[-1].peak_memory_mb:.0f} MiB"
        rows.append((str(each.stages[0].worlds), _speed(each.stages[0]), *ratios, f"{each.learn_share:.0%}", memory))
    show_columns(rows)
    if any(each.alternatives for each in measured):
        show()
        show_columns(_alternative_rows(measured))
        show()
        for line in _comparisons(measured):
            show(line)
    if measured[-1].shares:
        show()
        show_columns(_share_rows(measured[-1]))


def _ratio(measured: "Throughput", stage: "StageResult") -> str:
    low, high = measured.ratio_ranges[stage.backend, stage.stage]
    return f"{stage.ratio_to_physics:.3f} ({low:.2f}-{high:.2f})"


def _speed(stage: "StageResult") -> str:
    return f"{stage.control_steps_per_s:.0f}"


def _alternative_rows(measured: "Sequence[Throughput]") -> Sequence[tuple[str, ...]]:
    """What else could be used."""
    rows = [("instead", "worlds", "control steps/s", "ratio to physics", "peak memory")]
    for each in measured:
        for stage in each.alternatives:
            name = f"{stage.backend}, {stage.stage}"
            memory = f"{stage.peak_memory_mb:.0f} MiB"
            rows.append((name, str(stage.worlds), _speed(stage), _ratio(each, stage), memory))
    return rows


def _comparisons(measured: "Sequence[Throughput]") -> list[str]:
    """How many times faster the environment is than each alternative, every one with the worlds that suit it best."""
    best: dict[tuple[str, str], StageResult] = {}
    for each in measured:
        for stage in (*each.stages, *each.alternatives):
            key = stage.backend, stage.stage
            if key not in best or stage.control_steps_per_s > best[key].control_steps_per_s:
                best[key] = stage
    first = measured[0].stages[0]
    ours = best[first.backend, "environment"]
    return [
        f"environment at {ours.worlds} worlds: {ours.control_steps_per_s / other.control_steps_per_s:.2f} times "
        f"{backend}, {stage} at {other.worlds} worlds, its best"
        for (backend, stage), other in best.items()
        if backend != first.backend
    ]


def _share_rows(measured: "Throughput") -> Sequence[tuple[str, ...]]:
    """Where the time of a control step goes."""
    rows = [(f"environment step of {measured.stages[0].worlds} worlds", "share", "time", "calls")]
    for share in measured.shares:
        rows.append((f"  {share.name}", f"{share.share:.1%}", f"{share.time * 1e3:.3f} ms", f"{share.calls:.0f}"))
    return rows
