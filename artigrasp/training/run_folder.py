"""A training run's folder: what was asked for, how it went, and what came out."""

import csv
import importlib.metadata
import json
import subprocess
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import matplotlib

from artigrasp.config import SimulatorConfig, TaskConfig, from_dict, to_dict
from artigrasp.errors import UserError
from artigrasp.files import atomic_write, check_format

RUN_FORMAT, RUN_VERSION = "artigrasp.run", 1
RUN_FILE, CURVE_FILE = "run.json", "learning_curve.csv"


@dataclass(frozen=True)
class RunDescription:
    """What is trained on what; a run that is resumed keeps it."""

    task: TaskConfig
    objects: tuple[str, ...]
    split: str
    """Split whose references are played."""
    seed: int


@dataclass(frozen=True)
class CurvePoint:
    """Means over the episodes that ended in one iteration, while exploring on the training references."""

    iteration: int
    control_steps: int
    """Control steps so far, over all worlds."""
    wall_time: float
    """Training time so far [s]."""
    success: float
    angle_error: float
    """Final distance of the hinge from its goal [rad]."""


def new_run_folder(root: Path, task: TaskConfig) -> Path:
    """``root/<task>/<time>``, not made yet; a number is added if that is taken."""
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    folder = root / task.name / stamp
    count = 1
    while folder.exists():
        count += 1
        folder = root / task.name / f"{stamp}_{count}"
    return folder


def write_run_description(folder: Path, run: RunDescription, simulator: SimulatorConfig) -> None:
    """Write ``run.json``: the task in full, what it is trained on and where, versions and the commit of the program."""
    description = {
        "format": RUN_FORMAT,
        "version": RUN_VERSION,
        "objects": list(run.objects),
        "split": run.split,
        "seed": run.seed,
        **asdict(simulator),
        "commit": _git_commit(),
        "packages": {
            name: importlib.metadata.version(name)
            for name in ("artigrasp", "newton", "mujoco", "warp-lang", "torch", "rsl-rl-lib")
        },
        "task": to_dict(run.task),
    }
    with atomic_write(folder / RUN_FILE) as path:
        path.write_text(json.dumps(description, indent=2) + "\n", encoding="utf-8")


def read_run_description(folder: Path) -> RunDescription:
    """Read what a run trains.

    Raises:
        UserError: There is no run in the folder, or its ``run.json`` is malformed or newer than this program.
    """
    path = folder / RUN_FILE
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: expected the description of a run, found none: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"{path}: expected JSON, found something else: {error}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a table of keys and values, found {type(content).__name__}")
    check_format(content.get("format"), content.get("version"), RUN_FORMAT, RUN_VERSION, path)
    known = {field.name: content[field.name] for field in fields(RunDescription) if field.name in content}
    return from_dict(RunDescription, known, source=str(path))


def read_curve(folder: Path) -> list[CurvePoint]:
    """The learning curve so far; empty if there is none.

    Raises:
        UserError: The file is malformed.
    """
    path = folder / CURVE_FILE
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    types = {field.name: field.type for field in fields(CurvePoint)}
    try:
        return [CurvePoint(**{name: parse(row[name]) for name, parse in types.items()}) for row in rows]  # type: ignore[operator]
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: expected numbers in the columns {', '.join(types)}: {error}") from error


def write_curve(folder: Path, points: Sequence[CurvePoint], title: str) -> None:
    """Write ``learning_curve.csv`` and its plot."""
    with atomic_write(folder / CURVE_FILE) as path, path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(CurvePoint)])
        writer.writeheader()
        writer.writerows(vars(point) for point in points)
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
    git = ["git", "-C", str(Path(__file__).parent)]
    try:
        # an installed package may lie inside somebody else's checkout
        subprocess.run([*git, "ls-files", "--error-unmatch", Path(__file__).name], capture_output=True, check=True)
        describe = [*git, "describe", "--always", "--dirty", "--abbrev=40"]
        return subprocess.run(describe, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
