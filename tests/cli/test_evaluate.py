"""`artigrasp evaluate` and `artigrasp generate`: controllers at work."""

import json
from pathlib import Path

import pytest

from artigrasp.cli import main
from artigrasp.controllers.policy_file import save_policy
from artigrasp.motion.file import load_motion
from artigrasp.tasks import get_task
from tests.controllers.examples import example_policy

QUICK = ["--task", "quick"]


@pytest.fixture
def policy(work: Path) -> Path:
    """A policy file for the task ``quick``, in a folder of its own."""
    path = work / "trained" / "opener.pt"
    save_policy(example_policy(get_task("quick")), path)
    return path


def test_a_policy_is_measured_beside_baselines(work: Path, policy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Files and JSON agree; a baseline that is named twice is measured once; everybody plays the policy's task."""
    words = ["evaluate", "articulation", "--policy", "trained/opener.pt", "--baselines", "pd-ik", "zero", "zero"]
    assert main([*words, "--out", "measured", "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert metrics == json.loads((work / "measured" / "metrics.json").read_text())
    assert (metrics["task"], metrics["controller"], metrics["policy"]) == ("quick", "policy", "trained/opener.pt")
    assert (metrics["objects"], metrics["split"], metrics["trials"]) == (["lidded-box"], "test", 10)
    for name in ("pd-ik", "zero"):
        baseline = json.loads((work / "measured" / name / "metrics.json").read_text())
        assert (baseline["task"], baseline["controller"], baseline["policy"]) == ("quick", name, None)
    table = (work / "measured" / "metrics.md").read_text()
    assert [table.count(f"\n| {name} |") for name in ("policy", "pd-ik", "zero")] == [1, 1, 1]


def test_a_baseline_needs_no_policy(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """People get the table that metrics.md holds, in the folder that is named or in evaluation/."""
    words = ["evaluate", "articulation", "--controller", "zero", *QUICK, "--split", "train"]
    assert main(words) == 0
    text = capsys.readouterr().out
    assert text.rstrip("\n") == (work / "evaluation" / "metrics.md").read_text().rstrip("\n")
    assert "split train" in text and "15 trials of 3 references" in text


def test_a_motion_is_generated(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a policy PD+IK acts; the motion is what the file holds and the JSON says."""
    assert main(["generate", *QUICK, "--reference", "1", "--target-angle", "0.5", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    motion = load_motion(work / "motion.npz")
    assert result == {"motion": "motion.npz", "metrics": dict(motion.metrics)}
    assert (len(motion.time), motion.target_angle) == (21, 0.5)
    assert motion.provenance["controller"] == "pd-ik" and motion.provenance["reference"] == "made by hand 4"
    assert [path.name for path in work.iterdir()] == ["motion.npz"]


def test_a_policy_that_is_named_acts(work: Path, policy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It brings its task along; another controller must be asked for."""
    for words, name in (([], "policy"), (["--controller", "zero"], "zero")):
        assert main(["generate", "--policy", str(policy), "--out", "new/motion.npz", *words]) == 0
        assert f" by {name} from made by hand 3\nwrote new/motion.npz\n" in capsys.readouterr().out
        provenance = load_motion(work / "new" / "motion.npz").provenance
        assert (provenance["controller"], provenance["task"]) == (name, "quick")
