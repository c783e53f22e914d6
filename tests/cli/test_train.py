"""`artigrasp train`: a run from the command line, and one that is taken up again."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from artigrasp.cli import main
from artigrasp.config import CurriculumConfig
from artigrasp.controllers.policy_file import load_policy
from artigrasp.tasks import CURRICULA, TASKS

FILES = {"run.json", "learning_curve.csv", "learning_curve.png", "latest.pt", "policy.pt"}


def train(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    """Train for JSON."""
    assert main(["train", "quick", "--threads", "2", "--json", *words]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_run_and_its_continuation(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The folder holds all that the help promises; a resumed run keeps its settings and goes on to the new total."""
    result = train(capsys, "--worlds", "4", "--seed", "3")
    folder = Path(result["folder"])
    assert folder.parent == Path("runs/quick") and result["policy"] == str(folder / "policy.pt")
    assert (result["iterations"], result["control_steps"]) == (2, 2 * 20 * 4) and 0.0 <= result["success"] <= 1.0
    assert 0.0 < result["learn_share"] < 1.0
    assert {path.name for path in folder.iterdir() if "tfevents" not in path.name} == FILES
    described = json.loads((folder / "run.json").read_text())
    assert (described["objects"], described["split"], described["seed"]) == (["lidded-box"], "train", 3)
    assert (described["task"]["world_count"], described["threads"]) == (4, 2)

    again = train(capsys, "--resume", str(folder), "--iterations", "3")
    assert (again["folder"], again["iterations"], again["control_steps"]) == (str(folder), 3, 3 * 20 * 4)
    assert [path.name for path in Path("runs/quick").iterdir()] == [folder.name]
    policy = load_policy(folder / "policy.pt", task="quick")
    assert (policy.iteration, policy.seed, policy.task.iterations, policy.hand) == (3, 3, 3, "open")
    rows = (folder / "learning_curve.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in rows] == ["iteration", "1", "2", "3"]


def test_mujoco_warp_trains_and_is_measured(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The other backend takes the same ways, and what it did is on record."""
    where = ("--backend", "mjwarp", "--device", "cpu")
    result = train(capsys, "--worlds", "4", *where)
    described = json.loads((Path(result["folder"]) / "run.json").read_text())
    assert (described["backend"], described["device"]) == ("mjwarp", "cpu")
    assert (result["iterations"], result["control_steps"]) == (2, 2 * 20 * 4) and 0.0 <= result["success"] <= 1.0

    words = ["evaluate", "articulation", "--policy", result["policy"], *where, "--json"]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["settings"]["backend"] == "mjwarp"
    assert main(["generate", "--policy", result["policy"], "--reference", "0", *where, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["metrics"]["failed"] == 0.0


def test_people_are_told_where_the_policy_is(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Results on standard output, what goes on on standard error."""
    assert main(["train", "quick", "--iterations", "1", "--out", "mine"]) == 0
    captured = capsys.readouterr()
    (folder,) = Path("mine/quick").iterdir()
    assert (
        captured.out.startswith("1 iterations, 120 control steps, ")
        and f"policy: {folder / 'policy.pt'}\n" in captured.out
    )
    assert f"training quick on lidded-box in {folder}\n" in captured.err


def test_a_resumed_run_keeps_what_it_was(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is asked for must be what the run is; the run stays as it was."""
    folder = train(capsys, "--iterations", "1")["folder"]
    before = {path: path.read_bytes() for path in Path(folder).iterdir()}
    for words, message in (
        (["quick", "--worlds", "5"], "worlds: expected 5, found 6"),
        (["quick", "--seed", "1"], "seed: expected 1, found 0"),
        (["quick", "--split", "test"], "split: expected 'test', found 'train'"),
        (["quick", "--objects", "box"], "objects: expected ('box',), found ('lidded-box',)"),
        (["other"], "task: expected 'other', found 'quick'"),
    ):
        assert main(["train", *words, "--resume", folder]) == 2
        assert capsys.readouterr() == ("", f"error: {folder}/run.json: {message}\n")
        assert {path: path.read_bytes() for path in Path(folder).iterdir()} == before


def test_a_curriculum_trains_stage_after_stage(
    work: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every stage has its run folder and begins with networks of those before; what is done is not done again."""
    both = replace(TASKS["other"], name="together", hands=("left", "right"), fixed_base=False)
    stages = (TASKS["other"], replace(both, iterations=0), both)
    monkeypatch.setitem(CURRICULA, "quick-both", CurriculumConfig("quick-both", "For tests.", stages))
    words = ["train", "quick-both", "--iterations", "1", "--worlds", "4", "--threads", "2", "--json"]
    assert main(words) == 0
    result = json.loads(capsys.readouterr().out)
    folder = Path(result["folder"])
    assert [Path(each["folder"]).name for each in result["stages"]] == ["1-other", "2-together", "3-together"]
    assert [each["iterations"] for each in result["stages"]] == [1, 0, 1] and result["iterations"] == 2
    first, gathered, last = (load_policy(Path(each["policy"])) for each in result["stages"])
    assert list(gathered.actors) == ["left", "right"]
    assert all(
        torch.equal(gathered.actors["right"][name], first.actors["right"][name]) for name in first.actors["right"]
    )
    assert any(
        not torch.equal(last.actors["right"][name], first.actors["right"][name]) for name in first.actors["right"]
    )
    assert Path(result["policy"]) == folder / "policy.pt"
    assert (folder / "policy.pt").read_bytes() == Path(result["stages"][2]["policy"]).read_bytes()

    before = (folder / "1-other" / "latest.pt").read_bytes()
    assert main(["train", "quick-both", "--resume", str(folder), "--iterations", "1", "1", "2", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert [each["iterations"] for each in again["stages"]] == [1, 0, 2]
    assert (folder / "1-other" / "latest.pt").read_bytes() == before
    assert main(["train", "quick-both", "--iterations", "1", "2"]) == 2
    assert "iterations: expected one number or one for each of 3 stages, found 2" in capsys.readouterr().err


def test_evaluations_choose_the_best_policy(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The policy as it acts is measured between iterations, on a split of one's own choice."""
    result = train(capsys, "--worlds", "4", "--evaluate-every", "1", "--evaluation-split", "test")
    folder = Path(result["folder"])
    rows = [line.split(",") for line in (folder / "evaluations.csv").read_text().splitlines()]
    assert [row[0] for row in rows] == ["iteration", "1", "2"] and rows[0][4:6] == ["suc_a", "aae"]
    assert all(0.0 <= float(row[4]) <= 1.0 and float(row[5]) >= 0.0 for row in rows[1:])
    assert load_policy(folder / "best.pt").iteration in (1, 2)
    described = json.loads((folder / "run.json").read_text())
    assert (described["evaluation_split"], described["task"]["ppo"]["evaluation_interval"]) == ("test", 1)
