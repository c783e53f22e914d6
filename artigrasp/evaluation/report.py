"""The files of an evaluation: `metrics.json`, `trials.csv`, `metrics.md` and a plot."""

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from artigrasp.evaluation.protocols import PROTOCOLS, ArticulationOutcomes, measure_articulation
from artigrasp.evaluation.statistics import Estimate, estimate_mean
from artigrasp.files import atomic_write

METRICS_FORMAT, METRICS_VERSION = "artigrasp.metrics", 1

PAPER_ARTICULATION = {
    "PD+IK (paper)": (0.28, 0.80, 0.39),
    "D-Grasp (paper)": (0.22, 0.93, 0.49),
    "ArtiGrasp (paper)": (0.55, 0.57, 0.01),
}
"""Suc.A, AAE, SD of the paper's Table 1: eight ARCTIC objects, free base, two hands."""


@dataclass(frozen=True)
class Evaluation:
    """One controller measured on one set of trials."""

    task: str
    controller: str
    policy: str | None
    objects: tuple[str, ...]
    split: str
    seed: int
    settings: Mapping[str, Any]
    """Physics settings and versions that the numbers depend on."""
    outcomes: ArticulationOutcomes


def metrics_dict(evaluation: Evaluation) -> dict[str, Any]:
    """The stable, machine-readable summary (see the documentation of `evaluate`)."""
    outcomes = evaluation.outcomes
    return {
        "format": METRICS_FORMAT,
        "version": METRICS_VERSION,
        "task": evaluation.task,
        "controller": evaluation.controller,
        "policy": evaluation.policy,
        "objects": list(evaluation.objects),
        "split": evaluation.split,
        "seed": evaluation.seed,
        "trials": len(outcomes.goal_angle),
        "references": len(np.unique(outcomes.groups)),
        "failed": int(outcomes.failed.sum()),
        "settings": dict(evaluation.settings),
        "protocols": _plain(measure_articulation(outcomes)),
        "per_object": {
            name: _plain(measure_articulation(outcomes.select(outcomes.object == name)))
            for name in np.unique(outcomes.object).tolist()
        },
    }


def write_report(evaluations: Sequence[Evaluation], folder: Path) -> None:
    """Write the files of several controllers measured on the same trials.

    The first controller's ``metrics.json`` and ``trials.csv`` stand in the folder itself, those of the others in a
    subfolder named after the controller; ``metrics.md`` and ``success.png`` compare all of them.
    """
    for index, evaluation in enumerate(evaluations):
        place = folder if index == 0 else folder / evaluation.controller
        with atomic_write(place / "metrics.json") as path:
            path.write_text(json.dumps(metrics_dict(evaluation), indent=2, allow_nan=False) + "\n", encoding="utf-8")
        _write_trials(evaluation.outcomes, place / "trials.csv")
    with atomic_write(folder / "metrics.md") as path:
        path.write_text(metrics_table(evaluations), encoding="utf-8")
    _plot_success(evaluations, folder / "success.png")


def metrics_table(evaluations: Sequence[Evaluation]) -> str:
    """A Markdown table of every controller and protocol, with the paper's rows beneath for orientation."""
    first = evaluations[0]
    lines = [
        f"Articulation on {', '.join(first.objects)}, split {first.split}, seed {first.seed}: "
        f"{len(first.outcomes.goal_angle)} trials of {len(np.unique(first.outcomes.groups))} references, "
        "95 % intervals in brackets.",
        "",
        "| controller | Suc.A paper | Suc.A released | Suc.A strict | AAE rad | SD m | failed |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for evaluation in evaluations:
        measured = measure_articulation(evaluation.outcomes)
        cells = [_cell(measured[name]["suc_a"]) for name in PROTOCOLS]
        cells += [_cell(measured["paper"][name]) for name in ("aae", "sd")]
        lines.append(f"| {evaluation.controller} | {' | '.join(cells)} | {int(evaluation.outcomes.failed.sum())} |")
    for name, (success, error, distance) in PAPER_ARTICULATION.items():
        lines.append(f"| {name} | {success:.2f} | | | {error:.2f} | {distance:.2f} | |")
    for evaluation in evaluations[1:]:
        difference = estimate_mean(
            PROTOCOLS["paper"](first.outcomes).astype(float) - PROTOCOLS["paper"](evaluation.outcomes),
            first.outcomes.groups,
        )
        lines.append(
            f"\nSuc.A (paper) of {first.controller} minus {evaluation.controller}, paired by reference: "
            f"{_cell(difference)}."
        )
    lines += ["", "The paper's rows are its Table 1: eight ARCTIC objects on a free base, another simulator."]
    settings = ", ".join(f"{key} {value}" for key, value in first.settings.items())
    return "\n".join([*lines, "", f"Settings: {settings}.", ""])


def _cell(estimate: Estimate) -> str:
    interval = f" [{estimate.low:.3f}, {estimate.high:.3f}]" if estimate.low is not None else ""
    return f"{estimate.value:.3f}{interval}"


def _plain(protocols: dict[str, dict[str, Estimate]]) -> dict[str, Any]:
    return {name: {key: asdict(value) for key, value in row.items()} for name, row in protocols.items()}


def _write_trials(outcomes: ArticulationOutcomes, target: Path) -> None:
    columns = {**vars(outcomes), "angle_error": outcomes.angle_error}
    columns |= {f"success_{name}": success(outcomes) for name, success in PROTOCOLS.items()}
    with atomic_write(target) as path, path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _plot_success(evaluations: Sequence[Evaluation], target: Path) -> None:
    """Success against the goal angle, and the distribution of the final error."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    for evaluation in evaluations:
        outcomes = evaluation.outcomes
        goals = np.unique(outcomes.goal_angle)
        success = PROTOCOLS["paper"](outcomes)
        rates = [success[outcomes.goal_angle == goal].mean() for goal in goals]
        left.plot(goals, rates, marker="o", label=evaluation.controller)
        errors = np.sort(outcomes.angle_error)
        right.plot(errors, np.arange(1, len(errors) + 1) / len(errors), label=evaluation.controller)
    left.set(xlabel="goal angle [rad]", ylabel="Suc.A (paper)", ylim=(-0.02, 1.02))
    right.set(xlabel="final angle error [rad]", ylabel="share of trials below", xlim=(0, None), ylim=(0, 1.02))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    left.legend(frameon=False)
    with atomic_write(target) as path:
        figure.savefig(path, dpi=150)
    pyplot.close(figure)
