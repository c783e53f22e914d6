"""What a search found, as a file."""

from pathlib import Path

import numpy as np
import pytest

from artigrasp.arrays import load_arrays, save_arrays
from artigrasp.controllers.search import with_offsets
from artigrasp.errors import UserError
from artigrasp.evaluation.demonstrations import FORMAT, VERSION, demonstrations_of, load_demonstrations
from artigrasp.evaluation.report import write_report
from tests.evaluation.examples import TASK, evaluation_of, found_by_search, outcomes_of

SEARCHED = with_offsets(TASK)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """What an evaluation of a search with eight rollouts leaves for four trials."""
    outcomes = outcomes_of(4, goal_angle=[0.5, 1.0])
    evaluation = evaluation_of(outcomes, controller="search", rollout_count=8, found=found_by_search(), task=SEARCHED)
    write_report([evaluation], tmp_path)
    loaded = load_demonstrations(tmp_path / "demonstrations.npz")
    expected = demonstrations_of(evaluation)
    assert loaded.task == expected.task == SEARCHED
    for name in ("object", "source", "offsets", "rollouts", "success", "error"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(expected, name))
    assert loaded.targets["goal_angle"].tolist() == [0.5, 1.0, 0.5, 1.0]
    assert "Success of search by rollouts: " in (tmp_path / "metrics.md").read_text()
    return tmp_path / "demonstrations.npz"


def test_a_damaged_file_is_refused(path: Path) -> None:
    """One line names the file and the field."""
    arrays = load_arrays(path, FORMAT, VERSION)
    for name, value, message in (
        ("offsets", np.zeros((4, 1, 2, 14)), r"offsets: expected shape \(N=4, S=1, H=1, D=14\), found \(4, 1, 2, 14\)"),
        ("success", np.zeros((3, 8), bool), r"success: expected shape"),
        ("task", np.array("{}"), r"task: name"),
        ("error", None, "error: expected an array, found none"),
    ):
        changed = {key: array for key, array in (arrays | {name: value}).items() if array is not None}
        save_arrays(path, FORMAT, VERSION, changed)
        with pytest.raises(UserError, match=rf"demonstrations.npz: {message}"):
            load_demonstrations(path)


def test_only_a_search_demonstrates() -> None:
    """Whoever tried nothing has found nothing."""
    with pytest.raises(ValueError, match="expected a controller that searches"):
        demonstrations_of(evaluation_of(outcomes_of(2)))
