"""The paper's tables with our rows."""

from pathlib import Path

import pytest

from artigrasp.errors import UserError
from artigrasp.evaluation.report import write_report
from tests.evaluation.examples import evaluation_of, outcomes_of
from tools.paper_tables import TABLES, find_runs, rows_of, write_tables


def test_rows_stand_above_the_papers(tmp_path: Path) -> None:
    """Each controller with what was measured of it, splits below each other, and the paper's numbers beneath."""
    outcomes = outcomes_of(4, final_angle=[0.9, 0.9, 0.9, 0.0])
    baseline = evaluation_of(outcomes_of(4, final_angle=0.0), controller="pd-ik")
    write_report([evaluation_of(outcomes), baseline], tmp_path / "test")
    write_report([evaluation_of(outcomes, split="recon", rollout_count=64)], tmp_path / "images")
    measured = find_runs([tmp_path / "test", tmp_path / "images"])
    rows = rows_of(TABLES[0], "test", measured)
    assert [row[0] for row in rows] == ["policy", "pd-ik", "PD+IK (paper)", "D-Grasp (paper)", "ArtiGrasp (paper)"]
    policy, pd_ik, *_, paper = rows
    assert policy[1:6] == [""] * 5 and policy[6].startswith("0.750 [") and policy[-1] == "4 of 4"
    assert pd_ik[6].startswith("0.000 [") and paper[1:4] == ["0.71", "0.13", "0.69"] and paper[6] == "0.55"
    text = write_tables(measured)
    assert "| policy, 64 rollouts |" in text and "| ArtiGrasp (paper), references of the same frames" in text


def test_what_cannot_be_told_apart_is_refused(tmp_path: Path) -> None:
    """Two evaluations of one kind, and folders without any."""
    for name in "ab":
        write_report([evaluation_of(outcomes_of(1))], tmp_path / name)
    with pytest.raises(UserError, match="b: expected one evaluation of a kind, found two of articulation test policy"):
        find_runs([tmp_path])
    with pytest.raises(UserError, match="none: expected evaluations, found none"):
        find_runs([tmp_path / "none"])
