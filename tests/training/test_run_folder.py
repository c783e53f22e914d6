"""The files of a run."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.tasks import get_curriculum, get_task
from artigrasp.training import run_folder
from artigrasp.training.run_folder import (
    RUN_FILE,
    CurriculumDescription,
    RunDescription,
    locked,
    new_run_folder,
    read_curriculum_description,
    read_run_description,
    write_curriculum_description,
    write_run_description,
)

RUN = RunDescription(get_task("right-fixed-synergy"), ("lidded-box", "box"), "train", 5, "test")


def test_folders_never_collide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs in one second get two folders, and naming one makes none."""
    monkeypatch.setattr(run_folder.time, "strftime", lambda pattern: "noon")
    expected = [tmp_path / "right-fixed-synergy" / name for name in ("noon", "noon_2", "noon_3")]
    for folder in expected:
        assert new_run_folder(tmp_path, RUN.task.name) == folder
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


def test_a_curriculum_is_described_in_full(tmp_path: Path) -> None:
    """Its stages come back, and each is a run in a folder of its own."""
    run = CurriculumDescription(get_curriculum("artigrasp"), ("box",), "train", 5)
    write_curriculum_description(tmp_path, run)
    assert read_curriculum_description(tmp_path) == run
    assert run.stage(1) == RunDescription(get_task("left-fixed"), ("box",), "train", 5)
    names = ["1-right-fixed", "2-left-fixed", "3-both-free"]
    assert [run.stage_folder(tmp_path, index).name for index in range(3)] == names
    with pytest.raises(UserError, match=r"curriculum.json: expected the description of a run, found none"):
        read_curriculum_description(tmp_path / "elsewhere")


def test_stages_begin_with_the_newest_networks() -> None:
    """Each hand's network is that of the last stage that had one."""
    run = CurriculumDescription(get_curriculum("artigrasp"), ("box",), "train", 0)
    root = Path("run")
    assert run.starts(root, 0) == run.starts(root, 1) == []
    assert run.starts(root, 2) == [root / "1-right-fixed", root / "2-left-fixed"]
    stages = (*run.curriculum.stages, run.curriculum.stages[0])
    longer = replace(run, curriculum=replace(run.curriculum, stages=stages))
    assert longer.starts(root, 3) == [root / "3-both-free"]


def test_one_process_trains_in_a_folder(tmp_path: Path) -> None:
    """A second one is told so; the lock goes with its owner."""
    folder = tmp_path / "run"
    with locked(folder):
        message = "run: expected a folder of its own for a run, found another process"
        with pytest.raises(UserError, match=message), locked(folder):
            pass
        assert list(folder.iterdir()) == []
    with locked(folder):
        pass


def test_a_commit_is_that_of_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program that no checkout holds has no commit, whatever checkout it lies in."""
    monkeypatch.setattr(run_folder, "__file__", str(Path(__file__).parent / "not_tracked.py"))
    write_run_description(tmp_path, replace(RUN, seed=1), SimulatorConfig())
    assert json.loads((tmp_path / RUN_FILE).read_text())["commit"] == "unknown"
