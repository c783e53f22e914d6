"""The files of a run."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.tasks import get_task
from artigrasp.training import run_folder
from artigrasp.training.run_folder import (
    CURVE_FILE,
    RUN_FILE,
    CurvePoint,
    RunDescription,
    new_run_folder,
    read_curve,
    read_run_description,
    write_curve,
    write_run_description,
)

RUN = RunDescription(get_task("right-fixed-synergy"), ("lidded-box", "box"), "train", 5)
CURVE = [CurvePoint(1, 600, 1.25, 0.5, 0.75), CurvePoint(3, 1800, 3.5, 0.625, 0.25)]


def test_folders_never_collide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs in one second get two folders, and naming one makes none."""
    monkeypatch.setattr(run_folder.time, "strftime", lambda pattern: "noon")
    expected = [tmp_path / "right-fixed-synergy" / name for name in ("noon", "noon_2", "noon_3")]
    for folder in expected:
        assert new_run_folder(tmp_path, RUN.task) == folder
        assert not folder.exists()
        folder.mkdir(parents=True)


def test_a_run_is_described_in_full(tmp_path: Path) -> None:
    """What was trained on what comes back; versions, commit and threads are there for whoever compares."""
    write_run_description(tmp_path, RUN, SimulatorConfig(threads=2))
    assert read_run_description(tmp_path) == RUN
    content = json.loads((tmp_path / RUN_FILE).read_text())
    assert (content["format"], content["version"]) == ("artigrasp.run", 1)
    assert (content["backend"], content["device"], content["threads"]) == ("cpu", None, 2)
    assert content["packages"].keys() >= {"artigrasp", "mujoco", "torch"} and content["commit"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "expected the description of a run, found none"),
        ("{", "expected JSON, found something else"),
        ("[]", "expected a table of keys and values, found list"),
        ('{"format": "artigrasp.task", "version": 1}', "format: expected 'artigrasp.run'"),
        ('{"format": "artigrasp.run", "version": 2}', "version: expected at most 1, found 2"),
        ('{"format": "artigrasp.run", "version": 1}', "task: expected a value, found none"),
    ],
)
def test_what_describes_no_run_is_refused(tmp_path: Path, text: str | None, message: str) -> None:
    """A folder of something else cannot be resumed; one line names the file."""
    if text is not None:
        (tmp_path / RUN_FILE).write_text(text)
    with pytest.raises(UserError) as caught:
        read_run_description(tmp_path)
    assert str(caught.value).startswith(f"{tmp_path / RUN_FILE}: {message}")


def test_the_learning_curve_is_kept_and_drawn(tmp_path: Path) -> None:
    """Its numbers come back exactly; the plot is a picture of some size, also of a single point or of none."""
    assert read_curve(tmp_path) == []
    for points in ([], CURVE[:1], CURVE):
        write_curve(tmp_path, points, "right-fixed-synergy on lidded-box")
        assert read_curve(tmp_path) == points
        with Image.open(tmp_path / "learning_curve.png") as picture:
            assert picture.size == (1500, 540)
    assert (tmp_path / CURVE_FILE).read_text().splitlines()[1] == "1,600,1.25,0.5,0.75"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["learning_curve.csv", "learning_curve.png"]


def test_a_damaged_curve_is_named(tmp_path: Path) -> None:
    """A column that is gone or a word among the numbers is the user's to mend."""
    write_curve(tmp_path, CURVE, "")
    path = tmp_path / CURVE_FILE
    for old, new in (("success", "sucess"), ("1800", "many")):
        text = path.read_text()
        path.write_text(text.replace(old, new))
        with pytest.raises(UserError, match=f"{CURVE_FILE}: expected numbers in the columns iteration, "):
            read_curve(tmp_path)
        path.write_text(text)


def test_a_commit_is_that_of_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program that no checkout holds has no commit, whatever checkout it lies in."""
    monkeypatch.setattr(run_folder, "__file__", str(Path(__file__).parent / "not_tracked.py"))
    write_run_description(tmp_path, replace(RUN, seed=1), SimulatorConfig())
    assert json.loads((tmp_path / RUN_FILE).read_text())["commit"] == "unknown"
