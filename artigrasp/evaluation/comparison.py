"""Comparing two evaluations trial by trial."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.errors import UserError
from artigrasp.evaluation.evaluate import describe_controller
from artigrasp.evaluation.experiment import CRITERIA, Experiment
from artigrasp.evaluation.outcomes import group_numbers
from artigrasp.evaluation.protocols import EXPERIMENTS
from artigrasp.evaluation.report import METRICS_FORMAT, METRICS_VERSION, format_estimate, markdown_table
from artigrasp.evaluation.statistics import Estimate, estimate_mean
from artigrasp.files import read_csv, read_json

_REFERENCE = ("object", "reference", "source")
"""What names a trial besides its targets."""


@dataclass(frozen=True)
class Run:
    """An evaluation as its files tell it."""

    folder: Path
    metrics: Mapping[str, Any]
    """Contents of `metrics.json`."""
    trials: Mapping[tuple[str, ...], Mapping[str, str]]
    """Rows of `trials.csv` by what names a trial."""

    @property
    def label(self) -> str:
        """The controller and where it was measured."""
        return f"{self.controller} ({self.folder})"

    @property
    def controller(self) -> str:
        """The controller, see :func:`~artigrasp.evaluation.evaluate.describe_controller`."""
        settings = self.metrics.get("settings")
        retries = settings.get("retries", 0) if isinstance(settings, dict) else 0
        return describe_controller(self.metrics["controller"], self.metrics["rollouts"], retries)


@dataclass(frozen=True)
class Difference:
    """A metric in two runs, over the trials that both have."""

    first: float
    second: float
    difference: Estimate
    """First minus second, paired by trial; the interval counts references."""


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side; metrics are named as in `metrics.json`, success as ``suc_a_strict`` and the like."""

    runs: tuple[Run, Run]
    experiment: Experiment[Any]
    trial_count: int
    """Trials that both runs have."""
    left_out: tuple[int, int]
    """Trials that only one of them has."""
    overall: Mapping[str, Difference]
    per_object: Mapping[str, Mapping[str, Difference]]

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""

        def plain(differences: Mapping[str, Difference]) -> dict[str, Any]:
            return {
                name: {"first": each.first, "second": each.second, "difference": vars(each.difference)}
                for name, each in differences.items()
            }

        return {
            "runs": [str(run.folder) for run in self.runs],
            "experiment": self.experiment.name,
            "trials": self.trial_count,
            "left_out": list(self.left_out),
            "overall": plain(self.overall),
            "per_object": {name: plain(each) for name, each in self.per_object.items()},
        }


def load_run(folder: Path) -> Run:
    """Read an evaluation's files.

    Raises:
        UserError: They are missing, malformed or from a newer version.
    """
    path = folder / "metrics.json"
    metrics = read_json(path, METRICS_FORMAT, METRICS_VERSION, "a file of an evaluation")
    rows = read_csv(folder / "trials.csv", "a file of an evaluation")
    if missing := [name for name in ("experiment", "targets", "rollouts", "controller") if name not in metrics]:
        raise UserError(f"{path}: {missing[0]}: expected a value, found none: an older version wrote this evaluation")
    for name in ("experiment", "controller"):
        if not isinstance(metrics[name], str):
            raise UserError(f"{path}: {name}: expected a name, found {metrics[name]!r:.40}")
    if metrics["experiment"] not in EXPERIMENTS:
        known = ", ".join(EXPERIMENTS)
        raise UserError(f"{path}: experiment: expected one of {known}, found {metrics['experiment']!r:.40}")
    targets = metrics["targets"]
    if not isinstance(targets, list) or not all(isinstance(each, str) for each in targets):
        raise UserError(f"{path}: targets: expected a list of names, found {targets!r:.40}")
    columns = [*_REFERENCE, *targets]
    if rows and (missing := [name for name in columns if name not in rows[0]]):
        raise UserError(f"{folder / 'trials.csv'}: {missing[0]!r:.40}: expected a column, found none")
    seen: Counter[tuple[str, ...]] = Counter()
    trials = {}
    for row in rows:
        key = tuple(row[name] for name in columns)
        trials[(*key, str(seen[key]))] = row
        seen[key] += 1
    return Run(folder, metrics, trials)


def compare(first: Run, second: Run) -> Comparison:
    """Compare two runs over the trials that both have.

    Raises:
        UserError: They are of different experiments, or have no trial in common.
    """
    names = [run.metrics["experiment"] for run in (first, second)]
    if names[0] != names[1]:
        raise UserError(f"{second.folder}: expected an evaluation of {names[0]}, found one of {names[1]}")
    keys = [key for key in first.trials if key in second.trials]
    if not keys:
        raise UserError(f"{second.folder}: expected trials of {first.folder}, found none of them")
    experiment = EXPERIMENTS[names[0]]
    columns = {f"{experiment.success.key}_{name}": f"success_{name}" for name in CRITERIA}
    columns |= {metric.key: metric.column for metric in experiment.all_metrics}
    values = {name: tuple(_numbers(run, keys, column) for run in (first, second)) for name, column in columns.items()}
    objects = np.array([key[0] for key in keys])
    groups = group_numbers([[_words(first, keys, name) for name in names] for names in experiment.outcomes.grouping])

    def differences(rows: NDArray[np.bool_]) -> dict[str, Difference]:
        return {
            name: Difference(
                float(a[rows].mean()), float(b[rows].mean()), estimate_mean(a[rows] - b[rows], groups[rows])
            )
            for name, (a, b) in values.items()
        }

    return Comparison(
        (first, second),
        experiment,
        len(keys),
        (len(first.trials) - len(keys), len(second.trials) - len(keys)),
        differences(np.ones(len(keys), dtype=bool)),
        {name: differences(objects == name) for name in np.unique(objects).tolist()},
    )


def comparison_table(comparison: Comparison) -> str:
    """Markdown tables of all objects together and of each."""
    first, second = comparison.runs
    labels = {f"{comparison.experiment.success.key}_{name}": f"{comparison.experiment.success.label} {name}"
              for name in CRITERIA}  # fmt: skip
    labels |= {metric.key: metric.label for metric in comparison.experiment.all_metrics}
    lines = [f"{comparison.trial_count} trials that both have; first: {first.label}; second: {second.label}."]
    if any(comparison.left_out):
        lines.append(f"Left out, since only one has them: {comparison.left_out[0]} and {comparison.left_out[1]}.")
    rows = [
        [labels[name], f"{each.first:.3f}", f"{each.second:.3f}", format_estimate(each.difference)]
        for name, each in comparison.overall.items()
    ]
    lines += ["", markdown_table(["all objects", "first", "second", "first minus second"], rows)]
    rows = [
        [name, *(format_estimate(each[key].difference) for key in labels)]
        for name, each in comparison.per_object.items()
    ]
    lines += ["", markdown_table(["first minus second", *labels.values()], rows), ""]
    return "\n".join(lines)


def _words(run: Run, keys: list[tuple[str, ...]], column: str) -> NDArray[np.str_]:
    try:
        return np.array([run.trials[key][column] for key in keys])
    except KeyError:
        raise UserError(f"{run.folder / 'trials.csv'}: {column}: expected a column, found none") from None


def _numbers(run: Run, keys: list[tuple[str, ...]], column: str) -> Array:
    truths = {"True": 1.0, "False": 0.0}
    try:
        words = _words(run, keys, column).tolist()
        return np.array([truths[word] if word in truths else float(word) for word in words])
    except (TypeError, ValueError) as error:
        raise UserError(f"{run.folder / 'trials.csv'}: {column}: expected numbers, found others: {error}") from None
