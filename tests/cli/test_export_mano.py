"""Tests of `artigrasp export-mano`."""

import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.arctic_hand import mean_pose_path, save_mean_pose
from artigrasp.cli import main
from artigrasp.motion.file import save_motion
from tests.motion.example import example_motion


def test_parameters_are_written_beside_the_motion_or_where_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that was written is named; the mean pose is that of the imported hands."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    path, other = tmp_path / "motion.npz", tmp_path / "a.npz"
    save_motion(path, example_motion())
    assert main(["export-mano", str(path)]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'motion.mano.npz'}\n"
    assert main(["export-mano", str(path), "--mean-pose", "--out", str(other)]) == 2
    assert "mano_mean_pose.npz: no such file" in capsys.readouterr().err and not other.exists()
    mean_pose_path(tmp_path).parent.mkdir()
    save_mean_pose(mean_pose_path(tmp_path), {side: np.full(45, 0.25) for side in ("left", "right")})
    assert main(["export-mano", str(path), "--mean-pose", "--out", str(other), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"path": str(other)}
    flat, relative = (np.load(each)["right_hand_pose"] for each in (tmp_path / "motion.mano.npz", other))
    np.testing.assert_allclose(flat - relative, 0.25, atol=1e-6)
