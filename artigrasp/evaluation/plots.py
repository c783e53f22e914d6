"""The picture of an evaluation: success per object, against the target and the rollouts, and how errors spread."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np

from artigrasp.evaluation.evaluate import Evaluation
from artigrasp.evaluation.statistics import estimate_rate
from artigrasp.files import atomic_write

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_evaluations(evaluations: Sequence[Evaluation[Any]], target: Path) -> None:
    """Draw controllers that were measured on the same trials side by side; success is the paper's."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 2, figsize=(10, 7), layout="constrained")
    for plot, each in zip((_plot_objects, _plot_targets, _plot_errors, _plot_rollouts), axes.flat, strict=True):
        plot(evaluations, each)
        each.grid(alpha=0.3)
        each.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, ncols=len(labels), loc="outside upper center")
    with atomic_write(target) as path:
        figure.savefig(path, dpi=150)
    pyplot.close(figure)


def _plot_objects(evaluations: Sequence[Evaluation[Any]], axes: "Axes") -> None:
    """Success on every object, with intervals."""
    names = np.unique(evaluations[0].outcomes.object).tolist()
    for number, evaluation in enumerate(evaluations):
        outcomes, success = evaluation.outcomes, _success(evaluation)
        rows = [outcomes.object == name for name in names]
        rates = [estimate_rate(success[mask], outcomes.groups[mask]) for mask in rows]
        values = np.array([each.value for each in rates])
        ends = np.array([(each.low, each.high) for each in rates], dtype=float)
        places = np.arange(len(names)) + min(0.2, 0.7 / len(evaluations)) * (number - (len(evaluations) - 1) / 2)
        axes.errorbar(places, values, np.abs(ends.T - values), fmt="o", markersize=4, capsize=2, label=evaluation.label)
    axes.set_xticks(range(len(names)), names, rotation=30, ha="right")
    axes.set(ylabel=f"{evaluations[0].experiment.success.label} (paper)", ylim=(-0.03, 1.03))


def _plot_targets(evaluations: Sequence[Evaluation[Any]], axes: "Axes") -> None:
    """Success against the target."""
    experiment = evaluations[0].experiment
    for evaluation in evaluations:
        values = getattr(evaluation.outcomes, experiment.target.column)
        edges = np.unique(values)
        if len(edges) > 8:
            edges = np.quantile(values, np.linspace(0.0, 1.0, 6))[:-1]
        bins = np.searchsorted(edges, values, side="right") - 1
        present = np.unique(bins)
        rates = [_success(evaluation)[bins == each].mean() for each in present]
        axes.plot([values[bins == each].mean() for each in present], rates, marker="o", markersize=4)
    axes.set(xlabel=experiment.target.label, ylabel=f"{experiment.success.label} (paper)", ylim=(-0.03, 1.03))


def _plot_errors(evaluations: Sequence[Evaluation[Any]], axes: "Axes") -> None:
    """Share of the trials whose error lies below a value."""
    metric = evaluations[0].experiment.metrics[0]
    for evaluation in evaluations:
        errors = np.sort(getattr(evaluation.outcomes, metric.column))
        axes.plot(errors, np.arange(1, len(errors) + 1) / len(errors))
    axes.set(xlabel=f"{metric.label} of a trial", ylabel="share of trials below", xlim=(0, None), ylim=(0, 1.03))


def _plot_rollouts(evaluations: Sequence[Evaluation[Any]], axes: "Axes") -> None:
    """Success of searches against their rollouts; those that do not search stay where they are."""
    most = max(each.rollout_count for each in evaluations)
    for evaluation in evaluations:
        if evaluation.found is None:
            axes.plot([0, max(most, 1)], [_success(evaluation).mean()] * 2)
            continue
        success, groups = evaluation.found.success, evaluation.outcomes.groups
        rates = [estimate_rate(column, groups) for column in success.T]
        counts = np.arange(1, len(rates) + 1)
        (line,) = axes.plot(counts, [each.value for each in rates])
        low, high = (np.array([getattr(each, end) for each in rates], dtype=float) for end in ("low", "high"))
        axes.fill_between(counts, low, high, alpha=0.2, color=line.get_color())
    axes.set(
        xlabel="rollouts of a search", ylabel=f"{evaluations[0].experiment.success.label} (paper)", ylim=(-0.03, 1.03)
    )


def _success(evaluation: Evaluation[Any]) -> np.ndarray:
    return np.asarray(evaluation.experiment.criteria["paper"](evaluation.outcomes))
