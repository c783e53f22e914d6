"""A training run's folder: what was asked for, how it went, and what came out."""

import csv
import importlib.metadata
import json
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import matplotlib

from artigrasp.config import TaskConfig, to_dict
from artigrasp.files import atomic_write

RUN_FORMAT, RUN_VERSION = "artigrasp.run", 1

CURVE_COLUMNS = ("iteration", "control_steps", "wall_time", "success", "angle_error")


@dataclass(frozen=True)
class CurvePoint:
    """One iteration of the learning curve, measured while exploring on the training references."""

    iteration: int
    control_steps: int
    wall_time: float
    success: float
    angle_error: float


def new_run_folder(root: Path, task: TaskConfig) -> Path:
    """``root/<task>/<time>``, not made yet; a number is added if that is taken."""
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    folder = root / task.name / stamp
    count = 1
    while folder.exists():
        count += 1
        folder = root / task.name / f"{stamp}_{count}"
    return folder


def write_run_description(
    folder: Path, task: TaskConfig, objects: Sequence[str], split: str, seed: int, threads: int
) -> None:
    """Write ``run.json``: the task in full, what it was trained on, versions and the commit of the program."""
    description = {
        "format": RUN_FORMAT,
        "version": RUN_VERSION,
        "objects": list(objects),
        "split": split,
        "seed": seed,
        "threads": threads,
        "commit": _git_commit(),
        "packages": {
            name: importlib.metadata.version(name)
            for name in ("artigrasp", "newton", "mujoco", "warp-lang", "torch", "rsl-rl-lib")
        },
        "task": to_dict(task),
    }
    with atomic_write(folder / "run.json") as path:
        path.write_text(json.dumps(description, indent=2) + "\n", encoding="utf-8")


def read_curve(folder: Path) -> list[CurvePoint]:
    """The learning curve so far; empty if there is none."""
    path = folder / "learning_curve.csv"
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    types = {field.name: field.type for field in fields(CurvePoint)}
    return [CurvePoint(**{name: types[name](row[name]) for name in CURVE_COLUMNS}) for row in rows]  # type: ignore[operator]


def write_curve(folder: Path, points: Sequence[CurvePoint], title: str) -> None:
    """Write ``learning_curve.csv`` and its plot."""
    with atomic_write(folder / "learning_curve.csv") as path, path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(CURVE_COLUMNS)
        writer.writerows([getattr(point, name) for name in CURVE_COLUMNS] for point in points)
    _plot_curve(folder / "learning_curve.png", points, title)


def _plot_curve(target: Path, points: Sequence[CurvePoint], title: str) -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    steps = [point.control_steps / 1e6 for point in points]
    left.plot(steps, [point.success for point in points], marker=".", color="tab:green")
    left.set(ylabel="success while exploring", ylim=(-0.02, 1.02))
    right.plot(steps, [point.angle_error for point in points], marker=".", color="tab:orange")
    right.set(ylabel="final angle error while exploring [rad]", ylim=(0, None))
    minutes = points[-1].wall_time / 60 if points else 0.0
    for axes in (left, right):
        axes.set_xlabel("control steps [million]")
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(f"{title}: {minutes:.1f} min of training")
    with atomic_write(target) as path:
        figure.savefig(path, dpi=150)
    pyplot.close(figure)


def _git_commit() -> str:
    """Commit of the checkout that the program runs from, or "unknown" for an installed package."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
