"""The files of an evaluation, which other programs read."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from artigrasp.errors import UserError
from artigrasp.evaluation.articulation import ArticulationOutcomes
from artigrasp.evaluation.evaluate import Evaluation
from artigrasp.evaluation.experiment import QUALITY_METRICS
from artigrasp.evaluation.report import metrics_dict, metrics_table, write_report
from tests.evaluation.examples import evaluation_of, outcomes_of


@pytest.fixture
def outcomes() -> ArticulationOutcomes:
    """Two references of the box, one of the laptop, two goals each."""
    return outcomes_of(
        6,
        object=["box"] * 4 + ["laptop"] * 2,
        reference=[0, 0, 1, 1, 0, 0],
        source=["a", "a", "b", "b", "a", "a"],
        goal_angle=[0.5, 1.5],
        final_angle=[0.5, 1.0, 0.0, 0.0, 0.4, 1.5],
        max_tilt=[0.0, 0.4, 0.0, 0.0, 0.0, 0.0],
        failed=[False, False, False, True, False, False],
    )


@pytest.fixture
def evaluation(outcomes: ArticulationOutcomes) -> Evaluation[ArticulationOutcomes]:
    """A policy measured on them."""
    return evaluation_of(outcomes)


def check_estimates(protocols: dict[str, Any], trials: int) -> None:
    """The part of the schema that is the same for all objects together and for each."""
    assert list(protocols) == ["paper", "released", "strict"]
    for row in protocols.values():
        assert list(row)[:3] == ["suc_a", "aae", "sd"]
        assert set(row) == {"suc_a", "aae", "sd", *(each.key for each in QUALITY_METRICS)}
        for estimate in row.values():
            assert list(estimate) == ["value", "low", "high", "trials"]
            assert estimate["trials"] == trials and isinstance(estimate["value"], float)
            assert estimate["low"] is None or estimate["low"] <= estimate["value"] <= estimate["high"]


def test_metrics_are_what_other_programs_expect(evaluation: Evaluation[ArticulationOutcomes]) -> None:
    """Keys, types and counts, in JSON that every reader takes, over all objects and for each."""
    metrics = json.loads(json.dumps(metrics_dict(evaluation), allow_nan=False))
    assert {name: value for name, value in metrics.items() if name not in ("protocols", "per_object")} == {
        "format": "artigrasp.metrics",
        "version": 1,
        "experiment": "articulation",
        "task": "right-fixed",
        "controller": "policy",
        "policy": "policy.pt",
        "rollouts": 0,
        "objects": ["box", "laptop"],
        "split": "test",
        "seed": 4,
        "targets": ["goal_angle"],
        "trials": 6,
        "references": 3,
        "failed": 1,
        "wall_time": 2.5,
        "settings": {"base": "fixed", "friction": 3.0},
    }
    check_estimates(metrics["protocols"], 6)
    assert list(metrics["per_object"]) == ["box", "laptop"]
    check_estimates(metrics["per_object"]["box"], 4)
    check_estimates(metrics["per_object"]["laptop"], 2)
    assert metrics["protocols"]["paper"]["suc_a"]["value"] == pytest.approx(4 / 6)
    assert metrics["protocols"]["strict"]["suc_a"]["value"] == pytest.approx(3 / 6)
    assert metrics["per_object"]["box"]["paper"]["suc_a"]["value"] == 0.5
    assert metrics["per_object"]["laptop"]["paper"]["aae"] == pytest.approx(
        {"value": 0.05, "low": None, "high": None, "trials": 2}
    )


def test_every_trial_is_a_row(evaluation: Evaluation[ArticulationOutcomes], tmp_path: Path) -> None:
    """The table alone is enough to compute everything again."""
    write_report([evaluation], tmp_path / "new" / "folder")
    folder = tmp_path / "new" / "folder"
    assert sorted(path.name for path in folder.iterdir()) == ["metrics.json", "metrics.md", "success.png", "trials.csv"]
    assert json.loads((folder / "metrics.json").read_text()) == json.loads(json.dumps(metrics_dict(evaluation)))
    with (folder / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    for name, column in evaluation.outcomes.columns().items():
        assert [row[name] for row in rows] == [str(value) for value in column.tolist()]
    assert [row["success_strict"] for row in rows] == ["True", "False", "False", "False", "True", "True"]
    np.testing.assert_allclose([float(row["angle_error"]) for row in rows], evaluation.outcomes.angle_error)
    with Image.open(folder / "success.png") as picture:
        assert picture.size == (1500, 1050)


def test_controllers_are_compared(evaluation: Evaluation[ArticulationOutcomes], tmp_path: Path) -> None:
    """Each has a row and files of its own, beside the paper's rows, and the first is compared with the others."""
    closed = replace(evaluation.outcomes, final_angle=np.zeros(6), failed=np.zeros(6, bool))
    baseline = replace(evaluation, controller="zero", policy=None, outcomes=closed)
    write_report([evaluation, baseline], tmp_path)
    names = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert names == [
        "metrics.json", "metrics.md", "success.png", "trials.csv", "zero/metrics.json", "zero/trials.csv"
    ]  # fmt: skip
    assert json.loads((tmp_path / "zero" / "metrics.json").read_text())["policy"] is None
    lines = (tmp_path / "metrics.md").read_text().splitlines()
    assert "split test, seed 4: 6 trials of 3 references" in lines[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    rows = [row for row in rows if len(row) == len(rows[0])]  # the table of objects has other columns
    cells = {row[0]: row for row in rows}
    assert cells["policy"][1].startswith("0.667 [") and cells["policy"][3].startswith("0.500 [")
    assert cells["policy"][-1] == "1" and cells["zero"][1].startswith("0.000 [")
    assert [cells["ArtiGrasp (paper)"][column] for column in (1, 4, 5)] == ["0.55", "0.57", "0.01"]
    assert len(rows) == 2 + 2 + 3, "every row has every column"
    assert "| policy | strict | 0.250 | 1.000 |" in lines and "| zero | paper | 0.000 | 0.000 |" in lines
    assert "| zero | 6 of 6 | fell shut again 6 |" in lines
    assert any("policy minus zero, paired by reference: 0.667 [" in line for line in lines)
    assert any(line.startswith("Settings: base fixed, friction 3.0") for line in lines)


def test_one_reference_has_no_interval(evaluation: Evaluation[ArticulationOutcomes]) -> None:
    """The table shows its mean alone."""
    single = evaluation_of(evaluation.outcomes.select(evaluation.outcomes.object == "laptop"), objects=("laptop",))
    row = next(line for line in metrics_table([single]).splitlines() if line.startswith("| policy"))
    assert row.split("|")[5].strip() == "0.050"


def test_numbers_that_are_none_never_reach_a_file(evaluation: Evaluation[ArticulationOutcomes], tmp_path: Path) -> None:
    """JSON does not know them, and half a report is worse than none."""
    spoilt = replace(evaluation.outcomes, final_angle=np.full(6, np.nan))
    with pytest.raises(ValueError, match="JSON"):
        write_report([evaluation_of(spoilt)], tmp_path / "out")
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_file_in_the_folders_place_is_the_users_mistake(
    evaluation: Evaluation[ArticulationOutcomes], tmp_path: Path
) -> None:
    """One line names it."""
    (tmp_path / "out").write_text("mine")
    with pytest.raises(UserError, match=r"out: expected a folder to write to, found a file"):
        write_report([evaluation], tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"
