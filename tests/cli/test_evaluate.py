"""`artigrasp evaluate` and `artigrasp generate`: controllers at work."""

import json
from pathlib import Path

import pytest

from artigrasp.cli import main
from artigrasp.controllers.policy_file import save_policy
from artigrasp.evaluation.articulation import ARTICULATION
from artigrasp.evaluation.demonstrations import load_demonstrations
from artigrasp.evaluation.grasping import GRASPING
from artigrasp.evaluation.protocols import PROTOCOLS, Protocol
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
    assert [table.count(f"\n| {name} |") for name in ("policy", "pd-ik", "zero")] == [3, 3, 3], (
        "success, errors, what failed"
    )


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


def test_a_search_has_a_row_of_its_own(work: Path, policy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside what it searches around; it says how many rollouts it had and leaves what it found."""
    words = ["evaluate", "articulation", "--policy", str(policy), "--search", "3", "--baselines", "policy", "search"]
    assert main([*words, "--per-object", "2", "--worlds", "6", "--out", "searched"]) == 0
    table = capsys.readouterr().out
    labels = ("policy+search, 3 rollouts", "policy", "search, 64 rollouts")
    assert [table.count(f"\n| {label} |") for label in labels] == [3, 3, 3], "success, errors, what failed"
    folder = work / "searched"
    metrics = json.loads((folder / "metrics.json").read_text())
    assert (metrics["controller"], metrics["rollouts"], metrics["trials"]) == ("policy+search", 3, 2)
    assert load_demonstrations(folder / "demonstrations.npz").success.shape == (2, 3)
    assert json.loads((folder / "policy" / "metrics.json").read_text())["rollouts"] == 0
    assert not (folder / "chunks").exists()
    assert main(["compare", str(folder), str(folder / "policy"), "--json"]) == 0
    compared = json.loads(capsys.readouterr().out)
    assert (compared["experiment"], compared["trials"], compared["left_out"]) == ("articulation", 2, [0, 0])
    assert main(["compare", str(folder), str(folder / "search")]) == 0
    assert "| Suc.A paper |" in capsys.readouterr().out


def test_a_search_generates(work: Path) -> None:
    """The motion says how it came about."""
    assert main(["generate", *QUICK, "--controller", "search", "--search", "2"]) == 0
    provenance = load_motion(work / "motion.npz").provenance
    assert (provenance["controller"], provenance["rollouts"]) == ("search", "2")


def test_splits_have_folders_of_their_own(work: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A protocol of two splits."""
    monkeypatch.setitem(PROTOCOLS, "both", Protocol("both", "for tests", (ARTICULATION,), splits=("train", "test")))
    assert main(["evaluate", "both", "--controller", "zero", *QUICK, "--goal-angles", "0.5", "1"]) == 0
    for split, trials in (("train", 6), ("test", 4)):
        metrics = json.loads((work / "evaluation" / f"articulation-{split}" / "metrics.json").read_text())
        assert (metrics["split"], metrics["trials"]) == (split, trials)


def test_a_policy_is_measured_in_what_it_has_learned(
    work: Path, policy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """PD+IK, which would act in its place in other experiments, is not taken for it."""
    monkeypatch.setitem(PROTOCOLS, "two", Protocol("two", "for tests", (ARTICULATION, GRASPING)))
    assert main(["evaluate", "two", "--policy", str(policy), "--goal-angles", "1"]) == 0
    assert (work / "evaluation" / "metrics.json").is_file()
    assert "grasping is left out: the policy learned to articulate only" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["left-out", "--policy", "trained/opener.pt"],
            "objects: expected objects that trained/opener.pt has not seen",
        ),
        (
            ["grasping", "--policy", "trained/opener.pt"],
            "policy: expected one that learned to grasp, found one for art",
        ),
        (["images", "--controller", "zero"], "found none; there are"),
        (["juggling", "--controller", "zero"], "unknown protocol 'juggling'"),
        (
            ["articulation", "--controller", "zero", "--goal-angles", "-1"],
            "expected angles from 0 to a turn",
        ),
        (["grasping", "--controller", "zero", "--targets", "31"], "targets: expected a number from 1 to 30, found 31"),
        (["articulation", "--controller", "search", "--search", "-1"], "rollouts: expected a positive number"),
        (["articulation", "--controller", "zero", "--per-object", "0"], "per-object: expected a positive number"),
    ],
)
def test_what_cannot_be_measured(
    words: list[str], message: str, work: Path, policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line names it, and nothing is written."""
    assert main(["evaluate", *words]) == 2
    assert message in capsys.readouterr().err and not (work / "evaluation").exists()
