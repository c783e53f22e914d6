"""`artigrasp generate --sequence`: whole motions of the shipped box, from its shipped references."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.cli import main
from artigrasp.motion.file import load_motion
from artigrasp.motion.kinematics import link_poses

WHOLE = ["grasp", "relocate", "put down", "release", "retreat", "transit", "articulate"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The empty folder that the user is in, without assets of their own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "none"))
    return tmp_path


def test_the_box_is_carried_put_down_and_opened(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All phases pass; in between the box is in the air; its base ends at the target; wrists never jump."""
    words = ["generate", "--sequence", "grasp-then-articulate", "--target-yaw", "0.3", "--target-angle", "0.6"]
    assert main([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert list(result["phases"]) == WHOLE
    assert {result["phases"][name] for name in WHOLE[:6]} == {"done"}
    motion = load_motion(folder / "motion.npz")
    assert list(dict.fromkeys(motion.phases)) == WHOLE and motion.hands == ("left", "right")
    carried = motion.object_pose[motion.phases == "put down"]
    assert carried[0, 2] > 0.12 and carried[-1, 2] < 0.03
    set_down = motion.object_pose[motion.phases == "release"][-1]
    np.testing.assert_allclose(set_down[:2], [-0.08, -0.08], atol=0.03)
    np.testing.assert_allclose(Rotation.from_quat(set_down[3:]).as_rotvec(), [0.0, 0.0, 0.3], atol=0.1)
    wrists = link_poses(motion, [load_hand("open", side) for side in motion.hands])[:, :, 0]
    assert np.abs(np.diff(wrists[..., :3], axis=0)).max() < 0.03, "bases that move do not show"
    assert np.abs(np.diff(motion.joint_q[..., 3:6], axis=0)).max() < 0.3
    assert motion.provenance["first reference"].startswith("author_box_grasps")
    assert motion.provenance["task"] == "both-free" and motion.provenance["retries"] == "0"


def test_the_other_order_opens_first(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """People are told what became of each phase, and how far from its target the box is."""
    words = ["generate", "--sequence", "articulate-then-grasp", "--target-angle", "0.4", "--out", "other.npz"]
    assert main(words) == 0
    text = capsys.readouterr().out
    assert "rad from its target pose" in text and "grasp done" in text and "wrote other.npz" in text
    phases = load_motion(folder / "other.npz").phases
    assert list(dict.fromkeys(phases)) == ["articulate", "release", "retreat", "transit", *WHOLE[:3], "hold"]
