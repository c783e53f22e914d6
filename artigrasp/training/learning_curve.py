"""What training measured, iteration by iteration: a table beside its plot."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import matplotlib
import numpy as np

from artigrasp.arrays import Array
from artigrasp.errors import UserError
from artigrasp.files import atomic_write, read_csv, write_csv

CURVE_FILE, CURVE_PLOT = "learning_curve.csv", "learning_curve.png"


@dataclass(frozen=True)
class CurvePoint:
    """Means over the episodes that ended in one iteration, while exploring on the training references.

    What no episode that ended could show is no number, as the success of articulation where only grasps are played.
    """

    iteration: int
    control_steps: int
    """Control steps so far, over all worlds and processes."""
    wall_time: float
    """Training time so far [s]."""
    cpu_time: float = math.nan
    """Processor time of that, over all threads and processes [s]."""
    reward: float = math.nan
    """Sum of a hand's rewards in an episode."""
    success: float = math.nan
    """Share of articulations that opened the object and kept it open."""
    angle_error: float = math.nan
    """Final distance of the hinge from its goal in articulation [rad]."""
    lifted: float = math.nan
    """Share of grasps that hold the object in the air at the end."""


P = TypeVar("P", bound=Any)
"""Points of curves: of :class:`CurvePoint`, or of evaluations."""


def read_curve(folder: Path) -> list[CurvePoint]:
    """The learning curve of a run so far; empty if there is none.

    Raises:
        UserError: The file is malformed.
    """
    return read_points(folder / CURVE_FILE, CurvePoint)


def read_points(path: Path, kind: type[P]) -> list[P]:
    """The points of a curve's file, none where there is no file; columns that it lacks take their defaults.

    Raises:
        UserError: The file is malformed.
    """
    if not path.is_file():
        return []
    types = {field.name: field.type for field in fields(kind)}
    try:
        rows = read_csv(path, "a curve")
        return [kind(**{name: types[name](text) for name, text in row.items()}) for row in rows]  # type: ignore[operator]
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: expected numbers in the columns {', '.join(types)}: {error}") from error


def write_points(path: Path, points: Sequence[P], kind: type[P]) -> None:
    """Write the points of a curve."""
    columns = [field.name for field in fields(kind)]
    write_csv(path, columns, ([getattr(point, name) for name in columns] for point in points))


def join_stages(curves: Sequence[Sequence[P]]) -> list[P]:
    """The curves of a curriculum's stages as one, whose steps and times count from the first stage's beginning."""
    joined: list[P] = []
    before = dict.fromkeys(("iteration", "control_steps", "wall_time", "cpu_time"), 0)
    for curve in curves:
        for point in curve:
            joined.append(replace(point, **{name: getattr(point, name) + offset for name, offset in before.items()}))
        if joined:
            before = {name: getattr(joined[-1], name) for name in before}
    return joined


def write_curve(folder: Path, points: Sequence[CurvePoint], title: str) -> None:
    """Write the learning curve of a run and its plot."""
    write_points(folder / CURVE_FILE, points, CurvePoint)
    minutes = points[-1].wall_time / 60 if points else 0.0
    plot_curves(folder / CURVE_PLOT, {"": [points]}, f"{title}: {minutes:.1f} min of training")


QUANTITIES = {
    "success": "articulated while exploring",
    "lifted": "lifted while exploring",
    "reward": "reward of an episode",
    "angle_error": "final angle error [rad]",
}
"""What is drawn of a learning curve, with its axis label."""

EVALUATED = {
    "suc_a": "Suc.A, evaluated",
    "aae": "AAE, evaluated [rad]",
    "suc_g": "Suc.G, evaluated",
    "pe": "PE, evaluated [m]",
}
"""What is drawn of evaluations, with its axis label."""

RATES = ("success", "lifted", "suc_a", "suc_g")
"""Those of them that lie between 0 and 1."""

AXES = {
    "control_steps": ("control steps [million]", 1e-6),
    "wall_time": ("training time [min]", 1 / 60),
    "cpu_time": ("processor time [h]", 1 / 3600),
}
"""What it may be drawn against, with its axis label and scale."""


def plot_curves(
    target: Path,
    runs: Mapping[str, Sequence[Sequence[Any]]],
    title: str,
    axes: Sequence[str] = ("control_steps",),
    quantities: Mapping[str, str] = QUANTITIES,
) -> None:
    """Draw learning curves: a line for each name, the mean of its seeds in a band from their least to their largest.

    Args:
        target: Picture to write.
        runs: The curves of every name, one for each seed; a line ends where its shortest curve does. Points have the
            ``axes`` and ``quantities`` as attributes.
        title: Over the whole picture.
        axes: Of ``AXES``, a row of panels for each.
        quantities: What is drawn, with its axis label; what no run has is left out.
    """
    matplotlib.use("Agg")
    from matplotlib import pyplot

    every = [point for curves in runs.values() for curve in curves for point in curve]
    shown = [name for name in quantities if any(math.isfinite(getattr(point, name)) for point in every)]
    shown = shown or list(quantities)[:1]
    size = (5 * len(shown), 3.6 * len(axes))
    figure, panels = pyplot.subplots(len(axes), len(shown), figsize=size, layout="constrained", squeeze=False)
    for row, axis in zip(panels, axes, strict=True):
        label, scale = AXES[axis]
        for panel, name in zip(row, shown, strict=True):
            for run, curves in runs.items():
                _plot_band(panel, *_over_seeds(curves, axis, name, scale), label=run)
            panel.set(xlabel=label, ylabel=quantities[name])
            if name in RATES:
                panel.set_ylim(-0.02, 1.02)
            panel.grid(alpha=0.3)
            panel.spines[["top", "right"]].set_visible(False)
    if any(runs):
        panels[0, 0].legend(frameon=False)
    figure.suptitle(title)
    with atomic_write(target) as path:
        figure.savefig(path, dpi=150)
    pyplot.close(figure)


def _over_seeds(curves: Sequence[Sequence[CurvePoint]], axis: str, name: str, scale: float) -> tuple[Array, Array]:
    """Places [point] and, between each seed's own points interpolated, values [seed, point]."""
    tables = []
    for curve in curves:
        table = np.array([[scale * getattr(point, axis), getattr(point, name)] for point in curve]).reshape(-1, 2)
        tables.append(table[np.isfinite(table).all(axis=1)])
    tables = [table for table in tables if len(table)]
    if not tables:
        return np.zeros(0), np.zeros((1, 0))
    places = np.unique(np.concatenate([table[:, 0] for table in tables]))
    first, last = max(table[0, 0] for table in tables), min(table[-1, 0] for table in tables)
    places = places[(places >= first) & (places <= last)]
    return places, np.stack([np.interp(places, *table.T) for table in tables])


def _plot_band(panel: Any, places: Array, values: Array, label: str) -> None:
    (line,) = panel.plot(places, values.mean(axis=0), marker="." if len(places) < 50 else None, label=label)
    if len(values) > 1:
        panel.fill_between(places, values.min(axis=0), values.max(axis=0), color=line.get_color(), alpha=0.2, lw=0)
