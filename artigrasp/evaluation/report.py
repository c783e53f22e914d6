"""The files of an evaluation: `metrics.json`, `trials.csv`, `metrics.md`, a plot, and what a search found."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.evaluation.demonstrations import demonstrations_of, save_demonstrations
from artigrasp.evaluation.evaluate import Evaluation
from artigrasp.evaluation.experiment import CRITERIA, QUALITY_METRICS
from artigrasp.evaluation.plots import plot_evaluations
from artigrasp.evaluation.statistics import Estimate, estimate_mean
from artigrasp.files import write_csv, write_json, write_text

METRICS_FORMAT, METRICS_VERSION = "artigrasp.metrics", 1


def metrics_dict(evaluation: Evaluation[Any]) -> dict[str, Any]:
    """The stable, machine-readable summary (see the documentation of `evaluate`)."""
    outcomes, experiment = evaluation.outcomes, evaluation.experiment
    return {
        "format": METRICS_FORMAT,
        "version": METRICS_VERSION,
        "experiment": experiment.name,
        "task": evaluation.task.name,
        "controller": evaluation.controller,
        "policy": evaluation.policy,
        "rollouts": evaluation.rollout_count,
        "objects": list(evaluation.objects),
        "split": evaluation.split,
        "seed": evaluation.seed,
        "targets": list(evaluation.trials.targets),
        "trials": len(outcomes),
        "references": outcomes.reference_count,
        "failed": int(outcomes.failed.sum()),
        "wall_time": evaluation.wall_time,
        "settings": dict(evaluation.settings),
        "protocols": _plain(experiment.measure(outcomes)),
        "per_object": {
            name: _plain(experiment.measure(outcomes.select(outcomes.object == name)))
            for name in np.unique(outcomes.object).tolist()
        },
    }


def trial_columns(evaluation: Evaluation[Any]) -> dict[str, NDArray[Any]]:
    """The columns of `trials.csv`: what was asked for, what happened, and what of it is reported."""
    outcomes, experiment = evaluation.outcomes, evaluation.experiment
    columns: dict[str, NDArray[Any]] = outcomes.columns()
    columns |= {name: values for name, values in evaluation.trials.targets.items() if name not in columns}
    columns |= {each.column: getattr(outcomes, each.column) for each in experiment.all_metrics}
    columns |= {f"success_{name}": success(outcomes) for name, success in experiment.criteria.items()}
    if evaluation.found is not None:
        columns["rollouts"] = evaluation.found.rollouts
    return columns


def write_report(evaluations: Sequence[Evaluation[Any]], folder: Path) -> None:
    """Write the files of several controllers measured on the same trials.

    The first controller's ``metrics.json`` and ``trials.csv`` stand in the folder itself, those of the others in a
    subfolder named after the controller; ``metrics.md`` and ``success.png`` compare all of them.
    """
    for index, evaluation in enumerate(evaluations):
        place = folder if index == 0 else folder / evaluation.controller
        write_json(place / "metrics.json", metrics_dict(evaluation))
        trials = trial_columns(evaluation)
        write_csv(place / "trials.csv", list(trials), zip(*(each.tolist() for each in trials.values()), strict=True))
        if evaluation.found is not None:
            save_demonstrations(place / "demonstrations.npz", demonstrations_of(evaluation))
    write_text(folder / "metrics.md", metrics_table(evaluations))
    plot_evaluations(evaluations, folder / "success.png")


def metrics_table(evaluations: Sequence[Evaluation[Any]]) -> str:
    """A Markdown table of every controller and criterion, with the paper's rows beneath for orientation."""
    first, experiment = evaluations[0], evaluations[0].experiment
    rate, metrics = experiment.success, experiment.metrics
    header = ["controller", *(f"{rate.label} {name}" for name in CRITERIA), *(each.label for each in metrics), "failed"]
    rows = []
    for evaluation in evaluations:
        measured = experiment.measure(evaluation.outcomes)
        cells = [format_estimate(measured[name][rate.key]) for name in CRITERIA]
        cells += [format_estimate(measured["paper"][each.key]) for each in metrics]
        rows.append([evaluation.label, *cells, str(int(evaluation.outcomes.failed.sum()))])
    for name, row in experiment.paper_rows.get(first.split, {}).items():
        cells = [format(row[rate.key], ".2f") if rate.key in row else "", "", ""]
        cells += [format(row[each.key], ".2f") if each.key in row else "" for each in metrics]
        rows.append([f"{name} (paper)", *cells, ""])
    lines = [
        f"{experiment.name.capitalize()} on {', '.join(first.objects)}, split {first.split}, seed {first.seed}: "
        f"{len(first.outcomes)} trials of {first.outcomes.reference_count} references, "
        "95 % intervals in brackets.",
        "",
        markdown_table(header, rows),
        *_rollout_lines(evaluations),
        *(_difference_line(first, each) for each in evaluations[1:]),
    ]
    if first.split in experiment.paper_rows:
        lines += ["", f"The paper's rows: {experiment.paper_note}."]
    lines += ["", _quality_table(evaluations)]
    if len(first.objects) > 1:
        lines += ["", _object_table(evaluations)]
    lines += ["", _cause_table(evaluations)]
    times = ", ".join(f"{each.label} {each.wall_time:.0f} s" for each in evaluations)
    settings = ", ".join(f"{key} {value}" for key, value in first.settings.items())
    return "\n".join([*lines, "", f"Time to measure: {times}.", "", f"Settings: {settings}.", ""])


def format_estimate(estimate: Estimate) -> str:
    """The value and its interval."""
    size = abs(estimate.value)
    digits = 0 if size >= 10.0 else 3 if size >= 0.01 or not size else 5
    interval = f" [{estimate.low:.{digits}f}, {estimate.high:.{digits}f}]" if estimate.low is not None else ""
    return f"{estimate.value:.{digits}f}{interval}"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in [header, ["---"] * len(header), *rows])


def _quality_table(evaluations: Sequence[Evaluation[Any]]) -> str:
    """What is measured in every experiment."""
    rows = []
    for evaluation in evaluations:
        measured = evaluation.experiment.measure(evaluation.outcomes)["paper"]
        rows.append([evaluation.label, *(format_estimate(measured[each.key]) for each in QUALITY_METRICS)])
    return markdown_table(["controller", *(each.label for each in QUALITY_METRICS)], rows)


def _object_table(evaluations: Sequence[Evaluation[Any]]) -> str:
    """Success of every controller on every object."""
    experiment = evaluations[0].experiment
    names = np.unique(evaluations[0].outcomes.object).tolist()
    rows = []
    for evaluation in evaluations:
        for criterion in ("paper", "strict"):
            measured = [
                experiment.measure(evaluation.outcomes.select(evaluation.outcomes.object == name)) for name in names
            ]
            cells = [format(each[criterion][experiment.success.key].value, ".3f") for each in measured]
            rows.append([evaluation.label, criterion, *cells])
    return markdown_table(["controller", experiment.success.label, *names], rows)


def _cause_table(evaluations: Sequence[Evaluation[Any]]) -> str:
    """What went wrong in the trials of every controller that are no success by the paper's criterion."""
    rows = []
    for evaluation in evaluations:
        experiment, outcomes = evaluation.experiment, evaluation.outcomes
        failed = outcomes.cause[~experiment.criteria["paper"](outcomes)]
        causes = Counter(failed.tolist()).most_common()
        named = ", ".join(f"{cause or 'no phase failed'} {count}" for cause, count in causes)
        rows.append([evaluation.label, f"{len(failed)} of {len(outcomes)}", named])
    return markdown_table(["controller", "no success (paper)", "of these, what failed first"], rows)


def _rollout_lines(evaluations: Sequence[Evaluation[Any]]) -> list[str]:
    """Success of a search against the number of its rollouts, the first of which is what it searches around."""
    lines = []
    for evaluation in evaluations:
        if evaluation.found is not None:
            rates = evaluation.found.success.mean(axis=0)
            counts = [1 << power for power in range(len(rates).bit_length())]
            steps = ", ".join(f"{rates[count - 1]:.3f} with {count}" for count in counts if count <= len(rates))
            used = evaluation.found.rollouts.mean()
            lines.append(f"\nSuccess of {evaluation.controller} by rollouts: {steps}; {used:.1f} were used on average.")
    return lines


def _difference_line(first: Evaluation[Any], other: Evaluation[Any]) -> str:
    success = first.experiment.criteria["paper"]
    difference = estimate_mean(success(first.outcomes).astype(float) - success(other.outcomes), first.outcomes.groups)
    label = first.experiment.success.label
    return (
        f"\n{label} (paper) of {first.controller} minus {other.controller}, paired by reference: "
        f"{format_estimate(difference)}."
    )


def _plain(protocols: Mapping[str, Mapping[str, Estimate]]) -> dict[str, Any]:
    return {name: {key: asdict(value) for key, value in row.items()} for name, row in protocols.items()}
