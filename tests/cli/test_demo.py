"""`artigrasp demo`: the composed task on what is shipped."""

import json
from pathlib import Path

import pytest

from artigrasp.cli import main
from artigrasp.cli.policies import policies_for
from artigrasp.motion.file import load_motion


def test_an_open_object_is_carried_and_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A motion of all phases that does what the metrics say, with its USD, picture and report."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "none"))
    assert main(["demo", "--object", "open-waffle-iron", "--pairs", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["success"] and result["protocols"]["strict"]["suc_t"]["value"] == 1.0
    for name in ("motion", "usd", "picture", "evaluation"):
        assert Path(result[name]).exists()
    motion = load_motion(result["motion"])
    assert set(result["phases"]) == set(motion.phases) >= {"grasp", "relocate", "put down", "articulate"}
    assert abs(motion.hinge_angle[-1] - motion.target_angle) < 0.2
    assert motion.object_pose[:, 2].max() > 0.1 and motion.object_pose[-1, 2] < 0.03


def test_policies_are_found_by_what_they_learned_on() -> None:
    """By skill; there are none for an object that none has seen."""
    assert policies_for("lidded-box")["articulate"][0] == "lidded-box"
    assert policies_for("open-box-1000") == {}
