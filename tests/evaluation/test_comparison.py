"""Two evaluations held against each other."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import compare, comparison_table, load_run
from artigrasp.evaluation.report import write_report
from artigrasp.evaluation.statistics import estimate_mean
from tests.evaluation.examples import evaluation_of, outcomes_of

ANGLES = np.array([0.9, 0.8, 0.0, 0.0, 0.7, 0.6, 1.0, 1.1])


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    """Two controllers on two references of the box and two of the laptop, toward two goals each."""
    common = {
        "object": ["box"] * 4 + ["laptop"] * 4,
        "reference": [0, 0, 1, 1] * 2,
        "goal_angle": [0.5, 1.0],
    }
    first = evaluation_of(outcomes_of(8, **common, final_angle=ANGLES))
    second = evaluation_of(
        outcomes_of(8, **common, final_angle=0.25, max_tilt=0.5), controller="search", rollout_count=32
    )
    for name, evaluation in (("a", first), ("b", second)):
        write_report([evaluation], tmp_path / name)
    return tmp_path / "a", tmp_path / "b"


def test_differences_are_paired(runs: tuple[Path, Path]) -> None:
    """First minus second, over all trials and per object, with intervals that count references."""
    comparison = compare(load_run(runs[0]), load_run(runs[1]))
    assert (comparison.trial_count, comparison.left_out) == (8, (0, 0))
    assert list(comparison.overall)[:5] == ["suc_a_paper", "suc_a_released", "suc_a_strict", "aae", "sd"]
    success = comparison.overall["suc_a_paper"]
    assert (success.first, success.second, success.difference.value) == (0.75, 0.0, 0.75)
    goals = np.tile([0.5, 1.0], 4)
    errors = np.abs(goals - ANGLES) - np.abs(goals - 0.25)
    expected = estimate_mean(errors, np.repeat(np.arange(4), 2))
    assert vars(comparison.overall["aae"].difference) == pytest.approx(vars(expected))
    assert comparison.per_object["box"]["suc_a_paper"].difference.value == 0.5
    assert comparison.per_object["laptop"]["suc_a_strict"].first == 1.0
    table = comparison_table(comparison)
    assert "search, 32 rollouts" in table and "| Suc.A paper | 0.750 | 0.000 | 0.750 [" in table
    assert json.loads(json.dumps(comparison.to_dict(), allow_nan=False))["overall"]["sd"]["difference"]["value"] == 0.0


def test_order_does_not_matter_and_only_common_trials_count(runs: tuple[Path, Path]) -> None:
    """Rows are found by what was asked for; what one run lacks is told."""
    path = runs[1] / "trials.csv"
    header, *rows = path.read_text().splitlines()
    path.write_text("\n".join([header, *rows[:2:-1]]) + "\n")
    comparison = compare(load_run(runs[0]), load_run(runs[1]))
    assert (comparison.trial_count, comparison.left_out) == (5, (3, 0))
    assert comparison.overall["suc_a_paper"].first == pytest.approx(4 / 5)
    assert "only one has them: 3 and 0" in comparison_table(comparison)


def test_a_run_is_like_itself(runs: tuple[Path, Path]) -> None:
    """Every difference is nought."""
    comparison = compare(load_run(runs[0]), load_run(runs[0]))
    assert {(each.difference.value, each.difference.low) for each in comparison.overall.values()} == {(0.0, 0.0)}


def test_what_cannot_be_compared_is_refused(runs: tuple[Path, Path], tmp_path: Path) -> None:
    """Missing and damaged files, other versions, and runs without a trial in common; one line names the place."""
    with pytest.raises(UserError, match=r"none/metrics.json: expected a file of an evaluation"):
        load_run(tmp_path / "none")
    write_report([evaluation_of(outcomes_of(2, object="mixer"))], tmp_path / "c")
    with pytest.raises(UserError, match=r"c: expected trials of .*a, found none"):
        compare(load_run(runs[0]), load_run(tmp_path / "c"))
    metrics = json.loads((runs[0] / "metrics.json").read_text())
    for changes, message in (
        ({"version": 2}, "version: expected at most 1"),
        ({"controller": None}, "controller: expected a name, found None"),
        ({"experiment": []}, r"experiment: expected a name, found \[\]"),
        ({"experiment": "\n"}, r"experiment: expected one of .*, found '.n'"),
        ({"targets": None}, "targets: expected a list of names, found None"),
        ({"targets": [[]]}, r"targets: expected a list of names, found \[\[\]\]"),
        ({"format": "other"}, "format: expected 'artigrasp.metrics'"),
        ({"experiment": "juggling"}, "experiment: expected one of articulation"),
        ({"targets": ["weight"]}, r"trials.csv: 'weight': expected a column"),
    ):
        (runs[0] / "metrics.json").write_text(json.dumps(metrics | changes))
        with pytest.raises(UserError, match=message):
            load_run(runs[0])
    (runs[0] / "metrics.json").write_text("{")
    with pytest.raises(UserError, match="expected JSON"):
        load_run(runs[0])
    text = (runs[1] / "trials.csv").read_text()
    (runs[1] / "trials.csv").write_text(text.replace("True", "perhaps").replace("False", "no"))
    with pytest.raises(UserError, match=r"trials.csv: success_paper: expected numbers"):
        compare(run := load_run(runs[1]), replace(run))
