"""Train several tasks alike, with several seeds each, and compare what they have learned on references they never saw.

    python -m tools.measure_ablations TASK [TASK...] --objects NAME [NAME...] [--seeds 0 1 2] [--control-steps N]
        [--worlds N] [--scene TASK] [--goal-angles RAD...] [--out FOLDER] [--threads N]

Every task gets the same number of control steps in the same number of worlds, and is then measured by `artigrasp
evaluate articulation` in one scene. The first task is what the others are compared with. Trainings and evaluations that
are done are not done again, and one that was stopped goes on, but not where settings.json says that the folder is of
other objects, control steps, worlds, scene or goal angles; seeds come one after the other, so that there is
something to compare early. Writes comparison.md and comparison.png into the folder, and prints the table. Where a
success has an interval, it is over the trials of all seeds, counting references; how far seeds differ is
shown by itself.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import Run, load_run
from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.evaluation.statistics import Estimate, estimate_mean, estimate_rate
from artigrasp.files import atomic_write, read_json
from artigrasp.tasks import get_task
from artigrasp.training.run_folder import read_run_description
from artigrasp.training.runner import CHECKPOINT, POLICY

PROGRAM = str(Path(sys.executable).with_name("artigrasp"))
FORMAT, VERSION = "artigrasp.ablations", 1
SETTINGS = ("objects", "control_steps", "worlds", "scene", "goal_angles")
"""Options that everything in a folder shares; tasks and seeds may be added to it."""


@dataclass(frozen=True)
class Measured:
    """What the seeds of a task were measured to do, trial by trial."""

    task: str
    seeds: Sequence[int]
    cpu_times: Sequence[float]
    """Of each seed's training [s]."""
    reference: NDArray[np.str_]
    """What names each trial, shape [trial]."""
    success: NDArray[np.float64]
    """By the paper's criterion, shape [seed, trial]."""
    angle_error: NDArray[np.float64]
    """At the end [rad], shape [seed, trial]."""
    displacement: NDArray[np.float64]
    """Of the base, mean over the episode [m], shape [seed, trial]."""

    def rate(self) -> Estimate:
        """Success over all seeds and trials."""
        return estimate_rate(self.success.flatten(), self._groups())

    def mean(self, values: NDArray[np.float64]) -> Estimate:
        """A number of every trial, shape [seed, trial], over all of them."""
        return estimate_mean(values.flatten(), self._groups())

    def gain(self, over: "Measured") -> Estimate:
        """Success less that of another task, paired by trial and seed."""
        count = min(len(self.seeds), len(over.seeds))
        differences = self.success[:count] - over.success[:count]
        return estimate_mean(differences.flatten(), np.tile(self.reference, count))

    def _groups(self) -> NDArray[np.str_]:
        return np.tile(self.reference, len(self.seeds))


def keep_settings(options: argparse.Namespace) -> None:
    """Note what a folder's trainings and evaluations share.

    Raises:
        UserError: It has been begun otherwise.
    """
    path, asked = options.out / "settings.json", {name: getattr(options, name) for name in SETTINGS}
    if path.is_file():
        found = read_json(path, FORMAT, VERSION, "settings of ablations")
        for name, value in asked.items():
            if found.get(name) != value:
                raise UserError(f"{path}: {name}: expected {value}, found {found.get(name)}: choose another --out")
        return
    with atomic_write(path) as temporary:
        content = {"format": FORMAT, "version": VERSION, **asked}
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def train(task: str, seed: int, options: argparse.Namespace) -> Path:
    """The folder of a training that is done, after doing what is left of it."""
    config = get_task(task)
    steps = config.ppo.steps_per_env * config.action.decision_interval * options.worlds
    iterations = str(max(1, round(options.control_steps / steps)))
    out = options.out / "trainings" / f"seed-{seed}"
    runs = [path.parent for path in sorted(out.glob(f"{task}/*/{CHECKPOINT}"))]
    if runs and (runs[-1] / "done").is_file():
        return runs[-1]
    words = ["--objects", *options.objects, "--seed", str(seed), "--worlds", str(options.worlds), "--out", str(out)]
    words = ["--resume", str(runs[-1])] if runs else words
    words = [*words, "--iterations", iterations, "--threads", str(options.threads), "--json"]
    result = subprocess.run([PROGRAM, "train", task, *words], check=True, stdout=subprocess.PIPE, text=True)
    folder = Path(json.loads(result.stdout)["folder"])
    with atomic_write(folder / "done") as temporary:
        temporary.write_text(result.stdout, encoding="utf-8")
    return folder


def evaluate(folder: Path, task: str, seed: int, options: argparse.Namespace) -> Run:
    """The evaluation of a training."""
    out = options.out / "evaluations" / task / f"seed-{seed}"
    if not (out / "metrics.json").is_file():
        goals = ["--goal-angles", *map(str, options.goal_angles)]
        words = ["--policy", str(folder / POLICY), "--objects", *options.objects, "--scene", options.scene, *goals]
        words += ["--threads", str(options.threads), "--out", str(out)]
        subprocess.run([PROGRAM, "evaluate", "articulation", *words], check=True, stdout=subprocess.DEVNULL)
    return load_run(out)


def gather(task: str, folders: Sequence[Path], runs: Sequence[Run], seeds: Sequence[int]) -> Measured:
    """The seeds of a task side by side."""
    keys = list(runs[0].trials)
    rows = [[run.trials[key] for key in keys] for run in runs]
    return Measured(
        task,
        seeds,
        [json.loads((folder / "done").read_text(encoding="utf-8"))["cpu_time"] for folder in folders],
        np.array([" ".join(key[:2]) for key in keys]),
        np.array([[float(each["success_paper"] == "True") for each in row] for row in rows]),
        np.array([[float(each["angle_error"]) for each in row] for row in rows]),
        np.array([[float(each["mean_displacement"]) for each in row] for row in rows]),
    )


def table(measured: Sequence[Measured]) -> str:
    """One row per task."""
    rows = []
    for each in measured:
        gain = "" if each is measured[0] else format_estimate(each.gain(measured[0]))
        seeds = ", ".join(f"{value:.3f}" for value in each.success.mean(axis=1))
        cpu = f"{np.mean(each.cpu_times) / 60:.1f}"
        means = [format_estimate(each.mean(values)) for values in (each.angle_error, each.displacement)]
        rows.append([each.task, format_estimate(each.rate()), gain, seeds, *means, cpu])
    heads = ["task", "Suc.A paper", f"less {measured[0].task}", "of each seed", "AAE rad", "SD m", "CPU min a seed"]
    return markdown_table(heads, rows)


def plot(measured: Sequence[Measured], path: Path) -> None:
    """Success with its interval, and each seed as a dot."""
    figure = Figure(figsize=(8.0, 0.9 + 0.5 * len(measured)), layout="constrained")
    axes = figure.add_subplot()
    for row, each in enumerate(measured):
        rate = each.rate()
        axes.plot([rate.low, rate.high], [row, row], color="C0" if row else "C1", linewidth=5, alpha=0.35)
        axes.plot(rate.value, row, "|", color="C0" if row else "C1", markersize=16, markeredgewidth=3)
        axes.plot(each.success.mean(axis=1), np.full(len(each.seeds), row), "o", color="0.25", markersize=4)
    axes.set_yticks(range(len(measured)), [each.task for each in measured])
    axes.set_ylim(len(measured) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("Suc.A (paper), 95 % over references; dots are seeds")
    axes.grid(axis="x", alpha=0.3)
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)


def main() -> None:
    """Train, measure and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="+")
    parser.add_argument("--objects", nargs="+", required=True)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--control-steps", type=int, default=1_228_800)
    parser.add_argument("--worlds", type=int, default=256)
    parser.add_argument("--scene", default="both-free")
    parser.add_argument("--goal-angles", nargs="+", type=float, default=[1.0])
    parser.add_argument("--out", type=Path, default=Path("runs/ablations"))
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    done: dict[str, list[tuple[Path, Run]]] = {task: [] for task in options.tasks}
    try:
        keep_settings(options)
        for seed in options.seeds:
            for task in options.tasks:
                folder = train(task, seed, options)
                description = read_run_description(folder)
                assert (description.task.name, description.seed) == (task, seed)
                done[task].append((folder, evaluate(folder, task, seed, options)))
                present = [(name, pairs) for name, pairs in done.items() if pairs]
                measured = [
                    gather(name, [pair[0] for pair in pairs], [pair[1] for pair in pairs], options.seeds[: len(pairs)])
                    for name, pairs in present
                ]
                text = table(measured) + "\n"
                with atomic_write(options.out / "comparison.md") as temporary:
                    temporary.write_text(text, encoding="utf-8")
                plot(measured, options.out / "comparison.png")
    except UserError as error:
        parser.exit(2, f"error: {error}\n")
    except subprocess.CalledProcessError as error:
        parser.exit(1, f"error: {' '.join(error.cmd)} failed\n")
    print(text)


if __name__ == "__main__":
    main()
