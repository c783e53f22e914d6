"""Tests of the motion file: what is written comes back, and nothing else is let in."""

import dataclasses
import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artigrasp.config import StageConfig
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT
from artigrasp.motion.file import MotionBystanders, load_motion, save_motion
from tests.motion.example import example_motion, random_poses

BYSTANDERS = MotionBystanders(
    objects=("mixer", "lidded-box"),
    pose=random_poses(np.random.default_rng(1), 5, 2),
    hinge_angle=np.linspace(0, 1, 10).reshape(5, 2),
    focus=np.array([0, 0, 1, 2, 2]),
)


def assert_equal(actual: Any, expected: Any) -> None:
    """Two dataclasses hold the same values in every field."""
    for field in dataclasses.fields(expected):
        left, right = getattr(actual, field.name), getattr(expected, field.name)
        if dataclasses.is_dataclass(right):
            assert_equal(left, right)
        else:
            np.testing.assert_array_equal(left, right, err_msg=field.name)


@pytest.mark.parametrize("hands", [("right",), ("left", "right")])
@pytest.mark.parametrize("with_reference", [False, True])
def test_round_trip(tmp_path: Path, hands: tuple[str, ...], with_reference: bool) -> None:
    """A motion comes back bit for bit, with its types."""
    motion = example_motion(hands=hands)
    if not with_reference:
        motion = replace(motion, reference=None)
    path = tmp_path / "motion.npz"
    save_motion(path, motion)
    loaded = load_motion(path)
    assert_equal(loaded, motion)
    assert loaded.time.dtype == np.float64 and loaded.joint_q.dtype == np.float32
    assert loaded.metrics == motion.metrics and loaded.provenance == motion.provenance


def test_the_whole_scene_comes_back(tmp_path: Path) -> None:
    """Target pose, bystanders and stage are kept too."""
    motion = replace(
        example_motion(sample_count=5),
        target_object_pose=[0.1, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8],
        bystanders=BYSTANDERS,
        stage=StageConfig(0.05, (0.3, 0.2), (0.5, -0.25)),
    )
    save_motion(tmp_path / "motion.npz", motion)
    assert_equal(load_motion(tmp_path / "motion.npz"), motion)


def test_a_stage_checks_itself(tmp_path: Path) -> None:
    """A stage that is none is told by the file's name for it."""
    path = tmp_path / "motion.npz"
    save_motion(path, replace(example_motion(), stage=StageConfig(0.05, (0.3, 0.2))))
    _write_members(path, _members(path) | {"stage_height.npy": _npy(np.asarray(-1.0))})
    with pytest.raises(UserError, match=r"motion.npz: stage_height: expected .*, found -1"):
        load_motion(path)


def test_files_of_version_1_are_read(tmp_path: Path) -> None:
    """They lack what version 2 added, none of which they need."""
    path, motion = tmp_path / "motion.npz", example_motion()
    save_motion(path, motion)
    members = {name: content for name, content in _members(path).items() if not name.startswith("mano_")}
    _write_members(path, members | {"version.npy": _npy(np.asarray(1))})
    assert_equal(load_motion(path), motion)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint_q": np.zeros((5, 1, 50))}, r"joint_q: expected shape \(T=5, H=1, 51\), found \(5, 1, 50\)"),
        ({"hinge_angle": np.zeros(4)}, r"hinge_angle: expected shape \(T=5\), found \(4,\)"),
        ({"hinge_angle": [0, 1, np.nan, 0, 0]}, r"hinge_angle\[2\]: expected a finite number, found nan"),
        ({"object_pose": np.zeros((5, 7))}, r"object_pose\[0\]: expected a unit quaternion"),
        ({"time": [0, 1, 1, 2, 3]}, "time: expected strictly increasing"),
        ({"hands": ("right", "left")}, "hands: expected sides"),
        ({"hands": ()}, "hands: expected sides"),
        ({"object": ""}, "object: expected a name"),
        ({"phases": np.zeros(5)}, "phases: expected strings"),
        ({"target_angle": float("inf")}, "target_angle: expected a finite number"),
        ({"metrics": {"aae": float("nan")}}, "metrics: aae: expected a finite number"),
        ({"provenance": {"seed": 3}}, "provenance: seed: expected a string"),
        ({"target_object_pose": np.zeros(7)}, "target_object_pose: expected a unit quaternion"),
        ({"bystanders": replace(BYSTANDERS, objects=("", "mixer"))}, "bystander_objects: expected at least one name"),
        ({"bystanders": replace(BYSTANDERS, hinge_angle=np.zeros((5, 1)))}, r"bystander_hinge_angle: expected shape"),
        ({"bystanders": replace(BYSTANDERS, focus=[0, 1, 2, 3, 0])}, "bystander_focus: expected 0 to 2"),
    ],
)
def test_motion_checks_itself(change: dict[str, Any], message: str) -> None:
    """A motion with a wrong field cannot be made, and the message says what is wrong."""
    with pytest.raises(ValueError, match=message):
        replace(example_motion(sample_count=5), **change)


def _members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _write_members(path: Path, members: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def _npy(value: Any) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, value)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("format", np.asarray("artigrasp.references"), "format: expected 'artigrasp.motion'"),
        ("version", np.asarray(3), "version: expected at most 2, found 3: a newer version"),
        ("joint_q", np.zeros((2, 1, DOF_COUNT)), r"joint_q: expected shape \(T=5, H=1, 51\)"),
        ("joint_q", np.asarray([None]), "Object arrays cannot be loaded"),
        (
            "contact_force",
            np.full((5, 1, LINK_COUNT, 2, 3), np.inf),
            r"contact_force\[0, 0, 0, 0, 0\]: expected a finite",
        ),
        ("metrics", np.asarray("["), "metrics: expected a JSON object"),
        ("metrics", np.asarray("[" * 100_000), "metrics: expected a JSON object"),
        ("metrics", np.asarray(json.dumps({"aae": 10**400})), "metrics: aae: expected a finite number"),
        ("metrics", np.asarray(json.dumps({"aae": "low"})), "metrics: aae: expected a finite number"),
        ("mano_pose", np.zeros((5, 1, 15, 3)), r"mano_pose: expected shape"),
        ("stage_size", np.ones(2), "stage_height: this field is missing"),
        ("hands", np.asarray("right"), "hands: expected shape"),
        ("speed", np.zeros(3), "speed: unknown field"),
        ("reference_part", None, "reference_part: this field is missing"),
        ("time", None, "time: this field is missing"),
    ],
)
def test_reader_names_the_file_and_the_field(tmp_path: Path, field: str, value: Any, message: str) -> None:
    """A file with one bad, unknown or missing field is the user's mistake, told in one line."""
    path = tmp_path / "motion.npz"
    save_motion(path, example_motion(sample_count=5))
    members = _members(path)
    if value is None:
        del members[f"{field}.npy"]
    else:
        members[f"{field}.npy"] = _npy(value)
    _write_members(path, members)
    with pytest.raises(UserError, match=message) as caught:
        load_motion(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04", _npy(np.zeros(3)), b"\x80\x04K\x01."])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    """Empty files, text, cut archives, bare arrays and pickles are refused in one line."""
    path = tmp_path / "motion.npz"
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"expected an \.npz archive of plain arrays") as caught:
        load_motion(path)
    assert "\n" not in str(caught.value)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    """A path without a file is the user's mistake."""
    with pytest.raises(UserError, match="no such file"):
        load_motion(tmp_path / "none.npz")
    with pytest.raises(UserError, match=r"expected an \.npz archive"):
        load_motion(tmp_path)
