"""Tests of reading configs from plain data and files: strict, and plain about what is wrong."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artigrasp.config import (
    ActionConfig,
    PPOConfig,
    SynergyConfig,
    TaskConfig,
    from_dict,
    read_task,
    to_dict,
    write_task,
)
from artigrasp.errors import UserError

TASK = TaskConfig(
    name="right-fixed-synergy",
    description="One slow decision on a wrist that follows the hinge.",
    hands=("left", "right"),
    fixed_base=False,
    action=ActionConfig(wrist_prior="hinge", finger_prior="reference", synergy=SynergyConfig(), residual=None),
    ppo=PPOConfig(hidden_sizes=(64,), learning_rate=1e-3),
)


def test_round_trip_through_json() -> None:
    """A config survives JSON unchanged, with tuples, nested configs and terms that are left out."""
    assert from_dict(TaskConfig, json.loads(json.dumps(to_dict(TASK)))) == TASK


def test_absent_keys_take_defaults() -> None:
    """A config may be written down in part."""
    assert from_dict(PPOConfig, {"gamma": 1}) == PPOConfig(gamma=1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"iteratons": 5}, "run.json: iteratons: unknown key: did you mean 'iterations'?"),
        ({"ppo": {"gama": 0.9}}, "run.json: ppo.gama: unknown key: did you mean 'gamma'?"),
        ({"ppo": {"zzz": 0.9}}, "run.json: ppo.zzz: unknown key: expected one of steps_per_env, "),
        ({"ppo": {"gamma": "high"}}, "run.json: ppo.gamma: expected a number, found 'high'"),
        ({"ppo": {"gamma": True}}, "run.json: ppo.gamma: expected a number, found True"),
        ({"ppo": {"gamma": float("nan")}}, "run.json: ppo.gamma: expected a finite number, found nan"),
        ({"ppo": {"epochs": 2.5}}, "run.json: ppo.epochs: expected a whole number, found 2.5"),
        ({"ppo": {"gamma": 2}}, "run.json: ppo.gamma: expected a number between 0 and 1, found 2.0"),
        ({"ppo": {"hidden_sizes": [8, "x"]}}, "run.json: ppo.hidden_sizes[1]: expected a whole number, found 'x'"),
        ({"ppo": []}, "run.json: ppo: expected a table of keys and values, found []"),
        ({"physics": {"solref": [0.01]}}, "run.json: physics.solref: expected a list of 2 values, found [0.01]"),
        ({"physics": {"solref": 0.01}}, "run.json: physics.solref: expected a list, found 0.01"),
        ({"physics": {"cone": "round"}}, "run.json: physics.cone: expected one of 'elliptic', 'pyramidal', found"),
        ({"action": {"synergy": {"thumb": None}}}, "run.json: action.synergy.thumb: expected a number, found None"),
        ({"gains": {"fingers": {"kp": 1.0}}}, "run.json: gains.fingers.kd: expected a value, found none"),
        ({"fixed_base": 1}, "run.json: fixed_base: expected true or false, found 1"),
        ({"name": 3}, "run.json: name: expected a text, found 3"),
    ],
)
def test_bad_keys_and_values_are_named(change: dict[str, Any], message: str) -> None:
    """The message names the source, the dotted key, what was expected and what was found."""
    with pytest.raises(UserError) as caught:
        from_dict(TaskConfig, to_dict(TASK) | change, source="run.json")
    assert str(caught.value).startswith(message)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text() | st.sampled_from(sorted(to_dict(TASK))), inner),
    max_leaves=8,
)


@given(st.sampled_from(sorted(to_dict(TASK))), JSON)
def test_any_json_is_read_or_refused(key: str, value: Any) -> None:
    """Whatever stands in a file, reading it ends in a config or in the user's error."""
    try:
        assert isinstance(from_dict(TaskConfig, to_dict(TASK) | {key: value}), TaskConfig)
    except UserError as error:
        assert str(error).startswith("config: ")


def test_task_file_round_trip(tmp_path: Path) -> None:
    """A task comes back from its file, which carries format and version."""
    path = tmp_path / "task.json"
    write_task(path, TASK)
    assert read_task(path) == TASK
    content = json.loads(path.read_text())
    assert (content["format"], content["version"]) == ("artigrasp.task", 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "expected JSON"),
        ("[]", "expected a table of keys and values, found list"),
        ("{}", "format: expected 'artigrasp.task', found none"),
        ('{"format": "artigrasp.task", "version": 2}', "version: expected at most 1, found 2"),
        ('{"format": "artigrasp.task", "version": 1}', "name: expected a value, found none"),
        ('{"format": "artigrasp.task", "version": 1, "nam": 1}', "nam: unknown key: did you mean 'name'?"),
    ],
)
def test_bad_task_files_are_named(tmp_path: Path, text: str, message: str) -> None:
    """A file that is no task of ours is refused by its path."""
    path = tmp_path / "task.json"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        read_task(path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_missing_task_file_is_named(tmp_path: Path) -> None:
    """A path to nothing is the user's mistake."""
    with pytest.raises(UserError, match=r"nothing\.json: expected a task, found none to read: No such file"):
        read_task(tmp_path / "nothing.json")


def test_errors_show_little_of_what_is_large() -> None:
    """A list that names another nine times, nine deep, is some hundred bytes of YAML and gigabytes in words."""
    value: list[object] = ["x"]
    for _ in range(12):
        value = [value] * 9
    with pytest.raises(UserError, match="hands") as caught:
        from_dict(TaskConfig, {"name": "task", "description": "", "hands": value})
    assert len(str(caught.value)) < 10_000
