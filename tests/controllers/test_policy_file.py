"""Policy files: kept exactly, and read without running anything that is in them."""

import json
import pickle
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
import torch

from artigrasp.config import to_dict
from artigrasp.controllers.policy_file import load_policy, save_policy
from artigrasp.errors import UserError
from artigrasp.tasks import get_task
from tests.controllers.examples import example_policy
from tests.fuzzing import lists_of_the_same

SYNERGY = get_task("right-fixed-synergy")
DROPPED = object()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A saved policy."""
    save_policy(example_policy(SYNERGY), tmp_path / "policy.pt")
    return tmp_path / "policy.pt"


def change(path: Path, **changes: Any) -> None:
    """Replace fields of a saved policy; a field that becomes `DROPPED` goes."""
    contents = torch.load(path, weights_only=True) | changes
    torch.save({name: value for name, value in contents.items() if value is not DROPPED}, path)


def refusal(path: Path, task: str | None = None) -> str:
    """What the user is told about a file: one line that begins with its name."""
    with pytest.raises(UserError) as caught:
        load_policy(path, task)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message
    return message


def test_a_policy_is_kept_exactly(path: Path) -> None:
    """Every field comes back, the weights bit for bit; the folder holds nothing else."""
    saved, loaded = example_policy(SYNERGY), load_policy(path, task=SYNERGY.name)
    for field in fields(saved):
        if field.name != "actors":
            assert getattr(loaded, field.name) == getattr(saved, field.name), field.name
    assert loaded.actors.keys() == saved.actors.keys() == {"right"}
    found, expected = loaded.actors["right"], saved.actors["right"]
    assert found.keys() == expected.keys() and all(torch.equal(found[name], expected[name]) for name in expected)
    assert list(path.parent.iterdir()) == [path]


def test_a_checkpoint_keeps_the_learner(path: Path) -> None:
    """Tensors, numbers and tables of the learner's state come back."""
    learner = {"critic": {"weight": torch.arange(3.0)}, "optimizer": {"step": 4, "betas": (0.9, 0.999)}}
    save_policy(replace(example_policy(SYNERGY), learner=learner), path)
    found = load_policy(path).learner
    assert found is not None and torch.equal(found["critic"]["weight"], learner["critic"]["weight"])
    assert found["optimizer"] == learner["optimizer"]


def test_the_first_version_had_one_network_for_every_hand(path: Path) -> None:
    """Policies that were written before are read; their network acts for each hand as it is."""
    contents = torch.load(path, weights_only=True)
    task = replace(SYNERGY, hands=("left", "right"))
    weights = contents["actors"]["right"]
    change(path, version=1, task=json.dumps(to_dict(task)), actors=DROPPED, actor=weights)
    policy = load_policy(path)
    assert list(policy.actors) == ["left", "right"]
    for actor in policy.actors.values():
        assert all(torch.equal(actor[name], weights[name]) for name in weights)


class Trap:
    """Makes a file as soon as somebody unpickles it."""

    def __init__(self, sprung: Path) -> None:
        self.sprung = sprung

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.sprung,)


@pytest.mark.parametrize("place", ["whole", "field", "tensor", "plain"])
def test_a_pickle_is_refused_and_does_not_run(path: Path, place: str) -> None:
    """Wherever code hides in a file, as torch's archive or as a bare pickle, it is refused and never run."""
    trap = Trap(path.parent / "sprung")
    if place == "plain":
        path.write_bytes(pickle.dumps({"format": "artigrasp.policy", "trap": trap}))
    elif place == "whole":
        torch.save(trap, path)
    else:
        contents = torch.load(path, weights_only=True)
        if place == "field":
            contents["learner"] = trap
        else:
            contents["actors"]["right"]["trap"] = trap
        torch.save(contents, path)
    assert "expected a policy file with tensors and plain data only" in refusal(path)
    assert not trap.sprung.exists()
    if place != "plain":
        torch.load(path, weights_only=False)
    else:
        pickle.loads(path.read_bytes())  # noqa: S301
    assert trap.sprung.exists(), "the trap should have worked"


def test_a_policy_for_another_task_is_refused(path: Path) -> None:
    """The message names the file and both tasks."""
    message = refusal(path, task="right-fixed")
    assert "expected a policy for 'right-fixed', found one for 'right-fixed-synergy'" in message


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_refused(path: Path, share: float) -> None:
    """Half a download is no policy."""
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert "expected a policy file" in refusal(path)


LARGE = json.dumps(to_dict(replace(SYNERGY, ppo=replace(SYNERGY.ppo, hidden_sizes=(10**6, 10**6)))))
"""A task whose networks have as many weights as no memory has place for."""


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 3}, "version: expected at most 2, found 3: a newer version of artigrasp wrote this file"),
        ({"format": "artigrasp.motion"}, "format: expected 'artigrasp.policy', found 'artigrasp.motion'"),
        ({"format": DROPPED}, "format: expected 'artigrasp.policy', found none"),
        ({"features": 2}, "features: expected version 1, found 2: train it anew"),
        ({"hand": DROPPED}, "found a bad or missing field: hand: expected str, found NoneType"),
        ({"iteration": "many"}, "found a bad or missing field"),
        ({"task": "{"}, "found a bad or missing field"),
        (
            {"task": '{"name": "x", "description": "", "reward": {"angel": 1.0}}'},
            "reward.angel: unknown key: did you mean",
        ),
        ({"actors": {}}, "found a bad or missing field: actors: expected right, found none"),
        ({"actors": {"left": {}}}, "found a bad or missing field: actors: expected right, found left"),
        ({"actors": {"right": {}}}, "actors: expected the weights of the task's networks, found others"),
        ({"actors": {"right": {"mlp.0.weight": 3}}}, "actors: right: mlp.0.weight: expected finite numbers"),
        ({"actors": {"right": {"mlp.0.weight": torch.full((2,), torch.nan)}}}, "expected finite numbers"),
        ({"actors": {"right": {"mlp.0.weight": torch.eye(3).to_sparse()}}}, "tensors and plain data only"),
        ({"task": LARGE}, "actors: expected the weights of the task's networks, found others"),
        ({"actors": []}, "actors: expected dict, found list"),
        ({"objects": [["box"]]}, "objects: expected names"),
        ({"features": torch.ones(2)}, "features: expected version 1, found tensor([1., 1.]): train it anew"),
        ({"hand": lists_of_the_same(60, 2)}, "expected a policy file with tensors and plain data only"),
        ({"seed": torch.zeros(1).expand(2**40)}, "expected a policy file with tensors and plain data only"),
        ({"task": '{"name": "x", "description": ""}'}, "actors: expected the weights of the task's networks"),
    ],
)
def test_what_does_not_fit_is_named(path: Path, changes: dict[str, Any], message: str) -> None:
    """Another format, a newer version, a missing field, an unknown key of the task, weights of another network."""
    change(path, **changes)
    assert message in refusal(path)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    """Nothing, a folder, a text and a tensor are no policies."""
    torch.save(torch.zeros(3), tmp_path / "tensor.pt")
    (tmp_path / "text.pt").write_text("policy")
    for name in ("missing.pt", "tensor.pt", "text.pt", ""):
        assert "expected a policy file" in refusal(tmp_path / name)
