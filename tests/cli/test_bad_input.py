"""Bad input of the verbs that simulate: one line that names it, code 2, and nothing written."""

import json
import pickle
import traceback
from pathlib import Path

import numpy as np
import pytest

from artigrasp.cli import main
from artigrasp.cli.app import parse
from artigrasp.config import to_dict
from artigrasp.controllers.policy_file import save_policy
from artigrasp.errors import UserError
from artigrasp.motion.file import save_motion
from artigrasp.tasks import get_task
from tests.assets.foreign import foreign_urdf
from tests.controllers.examples import example_policy
from tests.motion.example import example_motion
from tests.references.arctic_example import write_release

VERBS = {
    "train": ["train", "quick"],
    "evaluate": ["evaluate", "articulation", "--controller", "zero", "--task", "quick"],
    "generate": ["generate", "--task", "quick"],
}
BOX = "lidded-box"


def refusal(words: list[str], work: Path, capfd: pytest.CaptureFixture[str]) -> str:
    """The one line that a verb ends with; nothing else is said, and the folder is as it was."""
    before = sorted(work.rglob("*"))
    assert main(words) == 2
    captured = capfd.readouterr()
    assert captured.out == ""
    lines = [line for line in captured.err.splitlines() if not line.startswith("Compiling kernels")]
    assert len(lines) == 1 and lines[0].startswith("error: "), captured.err
    assert sorted(work.rglob("*")) == before
    return lines[0].removeprefix("error: ")


def spoil_references(assets: Path, **changes: np.ndarray) -> None:
    """Replace arrays of the box's references."""
    path = assets / "references" / f"{BOX}.npz"
    with np.load(path) as archive:
        arrays = dict(archive)
    np.savez(path, **(arrays | changes))


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_object(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The name that was meant is suggested."""
    flag = "--object" if verb == "generate" else "--objects"
    message = refusal([*VERBS[verb], flag, "liddedbox"], work, capfd)
    assert message == "unknown object 'liddedbox': did you mean 'lidded-box'?"


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_task(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Likewise."""
    words = ["quik" if word == "quick" else word for word in VERBS[verb]]
    assert refusal(words, work, capfd) == "unknown task 'quik': did you mean 'quick'?"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["generate", "--seed", "-1"], "seed: expected 0 to 999999999999999999, found -1"),
        (["tell", "ketchup-into-box", "--seed", "1" + 30 * "0"], "seed: expected 0 to 999999999999999999"),
        (["demo", "--pairs", "0"], "pairs: expected a positive number, found 0"),
        (["bench", "--seconds", "inf"], "seconds: expected a positive number, found inf"),
    ],
)
def test_numbers_that_cannot_be(words: list[str], message: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """They are refused before anything is made of them."""
    assert refusal(words, work, capfd).startswith(message)


def test_too_much_is_told(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Memory that there is not, in one line."""
    assert main(["train", "quick", "--worlds", str(10**18)]) == 1
    message = capfd.readouterr().err.splitlines()[-1]
    assert message.startswith("error: not enough memory, ask for less: Unable to allocate")


@pytest.mark.parametrize("verb", VERBS)
def test_an_object_without_its_usd(verb: str, work: Path, assets: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """References alone make no object."""
    spoil_references(assets, object=np.array("chest"))
    (assets / "references" / f"{BOX}.npz").rename(assets / "references" / "chest.npz")
    flag = "--object" if verb == "generate" else "--objects"
    assert refusal([*VERBS[verb], flag, "chest"], work, capfd).startswith("unknown object 'chest': ")


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("text", ["", "not a stage", '#usda 1.0\n(defaultPrim = "Object")\ndef Xform "Object" {'])
def test_a_malformed_usd(verb: str, text: str, work: Path, assets: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The file is named, whether it is empty, something else, or broken off."""
    path = assets / "objects" / f"{BOX}.usda"
    path.parent.mkdir()
    path.write_text(text)
    assert str(path) in refusal(VERBS[verb], work, capfd)


@pytest.mark.parametrize("verb", VERBS)
def test_not_a_number_in_a_reference(verb: str, work: Path, assets: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """File, field and place are named."""
    angles = np.zeros((5, 2, 45), np.float32)
    angles[3, 1, 7] = np.nan
    spoil_references(assets, finger_angles=angles)
    message = refusal(VERBS[verb], work, capfd)
    assert f"{BOX}.npz: finger_angles[3, 1, 7]: expected a finite number, found nan" in message


@pytest.mark.parametrize("verb", VERBS)
def test_a_pickle_among_the_references(verb: str, work: Path, assets: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Arrays of objects are refused, not unpickled."""
    spoil_references(assets, source=np.array([{"any": "object"}] * 5, dtype=object))
    assert f"{BOX}.npz: expected an .npz archive of plain arrays" in refusal(VERBS[verb], work, capfd)


@pytest.mark.parametrize("verb", ["evaluate", "generate"])
def test_a_pickle_for_a_policy(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """It is refused, not unpickled."""
    (work / "policy.pt").write_bytes(pickle.dumps({"format": "artigrasp.policy", "version": 1}))
    message = refusal([*VERBS[verb], "--policy", "policy.pt"], work, capfd)
    assert message.startswith("policy.pt: expected a policy file")


@pytest.mark.parametrize("verb", ["evaluate", "generate"])
def test_a_policy_for_another_task(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A task that is named along with a policy must be the policy's."""
    save_policy(example_policy(get_task("other")), work / "policy.pt")
    message = refusal([*VERBS[verb], "--policy", "policy.pt"], work, capfd)
    assert message == "task: expected 'other', for which the policy is, found 'quick'"


@pytest.mark.parametrize("verb", ["evaluate", "generate"])
def test_an_unknown_policy_or_controller(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Neither a file nor a name; no such controller; a policy that acts but is not named."""
    assert refusal([*VERBS[verb], "--policy", "none.pt"], work, capfd) == "none.pt: no such file"
    assert refusal([*VERBS[verb], "--policy", "none"], work, capfd).startswith("unknown policy 'none': ")
    words = [word for word in VERBS[verb] if word not in ("--controller", "zero")]
    message = refusal([*words, "--controller", "pdik"], work, capfd)
    assert message == "unknown controller 'pdik': did you mean 'pd-ik'?"
    assert "'policy' needs a policy file" in refusal([*words, "--controller", "policy"], work, capfd)


def test_a_checkpoint_for_another_task(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A run whose checkpoint was replaced by one of another task cannot be resumed."""
    assert main(["train", "quick", "--iterations", "1", "--json"]) == 0
    folder = Path(json.loads(capfd.readouterr().out)["folder"])
    other = example_policy(get_task("other"), learner={})
    save_policy(other, folder / "latest.pt")
    message = refusal(["train", "quick", "--resume", str(folder), "--iterations", "2"], work, capfd)
    assert message == f"{folder}/latest.pt: task: expected a policy for 'quick', found one for 'other'"


def test_what_cannot_be_resumed(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """No run, a run of a newer program, and one whose task has a key that no task has."""
    words = ["train", "quick", "--resume", "run"]
    assert refusal(words, work, capfd).startswith("run/run.json: expected the description of a run, found none")
    (work / "run").mkdir()
    content = {"format": "artigrasp.run", "version": 2, "objects": [BOX], "split": "train", "seed": 0}
    content["task"] = to_dict(get_task("quick"))
    (work / "run" / "run.json").write_text(json.dumps(content))
    assert "run/run.json: version: expected at most 1, found 2" in refusal(words, work, capfd)
    content |= {"version": 1, "task": content["task"] | {"world_cout": 5}}
    (work / "run" / "run.json").write_text(json.dumps(content))
    message = refusal(words, work, capfd)
    assert message == "run/run.json: task.world_cout: unknown key: did you mean 'world_count'?"


@pytest.mark.parametrize("option", ["--iterations", "--worlds", "--threads"])
def test_numbers_of_nothing(option: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """None of them makes sense."""
    message = refusal(["train", "quick", option, "0"], work, capfd)
    assert message == f"{option[2:]}: expected a positive number, found 0"


def test_too_few_worlds(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A batch must have something in it, and every object a world."""
    message = refusal(["train", "quick", "--worlds", "3"], work, capfd)
    assert message == "world_count: expected at least 4, for 4 mini-batches, found 3"
    message = refusal(["train", "quick", "--worlds", "4", "--objects", *[BOX] * 5], work, capfd)
    assert message == "worlds: expected at least one per object (5), found 4"


@pytest.mark.parametrize("angle", ["-0.1", "3.2", "nan"])
def test_an_angle_that_the_object_does_not_reach(angle: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The object's own limit is told."""
    message = refusal([*VERBS["generate"], "--target-angle", angle], work, capfd)
    assert message == f"target-angle: expected 0 to 3.14 rad, as far as lidded-box opens, found {float(angle)}"


@pytest.mark.parametrize("verb", VERBS)
def test_a_split_without_references(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What there is, is told."""
    message = refusal([*VERBS[verb], "--split", "recon"], work, capfd)
    assert message.startswith("lidded-box: references of 'recon'") and "test articulate, train articulate" in message


def test_a_reference_that_is_not_there(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The range is told."""
    assert "expected indices from 0 to 1, found 2" in refusal([*VERBS["generate"], "--reference", "2"], work, capfd)


@pytest.mark.parametrize("verb", VERBS)
def test_a_file_where_a_folder_should_be(verb: str, work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Nothing is simulated for results that have no place."""
    (work / "taken").write_text("mine")
    out = "taken/motion.npz" if verb == "generate" else "taken"
    message = refusal([*VERBS[verb], "--out", out], work, capfd)
    assert message == f"{work / 'taken'}: expected a folder to write to, found a file"


WRITING = {
    "demo": "--out taken",
    "import-arctic": "release --destination taken",
    "extract-references": "release --out taken",
    "refine-references": "lidded-box --out taken",
    "synthesize-references": "lidded-box --out taken",
    "make-object": "laptop --out taken/o.usda",
    "import-object": "case.urdf --out taken/o.usda",
    "train": "quick --out taken",
    "evaluate": "articulation --controller zero --out taken",
    "generate": "--out taken/m.npz",
    "tell": "ketchup-into-box --out taken/m.npz",
    "render objects": "lidded-box --out taken/o.png",
    "render references": "lidded-box --out taken/r.png",
    "render motion": "m.npz --out taken/m.mp4",
    "export-usd": "m.npz --out taken/m.usdc",
    "export-mano": "m.npz --out taken/m.mano.npz",
    "export-policy": "lidded-box --out taken",
}
"""Every verb that writes, told to write below a file, where not even root can."""


@pytest.mark.parametrize("verb", WRITING)
def test_what_cannot_be_written_is_refused_before_the_work(verb: str, work: Path) -> None:
    """The verb looks at the place first: it is not the writing that fails."""
    (work / "taken").write_text("mine")
    foreign_urdf(work)
    write_release(work / "release")
    save_motion(work / "m.npz", example_motion(sample_count=2))
    before = sorted(work.rglob("*"))
    module, options = parse([*verb.split(), *WRITING[verb].split()])
    with pytest.raises(UserError, match=r"taken: expected a folder to write to, found a file") as caught:
        module.run(options)
    assert "atomic_write" not in [frame.name for frame in traceback.extract_tb(caught.tb)]
    assert sorted(work.rglob("*")) == before
