"""Tests of `artigrasp list` and of finding policies."""

import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.library import asset_files, find_file
from artigrasp.cli import main
from artigrasp.errors import UserError
from artigrasp.references.reference import ReferenceSet, save_references
from artigrasp.tasks import CURRICULA, TASKS


@pytest.fixture
def assets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's own asset folder."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    return tmp_path


def save_counted(root: Path, name: str, kinds: list[str], splits: list[str]) -> None:
    """Write references of one object with these kinds and splits."""
    count = len(kinds)
    pose = np.tile([0, 0, 0, 0, 0, 0, 1.0], (count, 2, 1))
    references = ReferenceSet(
        object=name,
        hand="open",
        kind=np.array(kinds),
        split=np.array(splits),
        active=np.tile([False, True], (count, 1)),
        part=np.ones((count, 2), dtype=np.int32),
        wrist_pose_in_part=pose,
        finger_angles=np.zeros((count, 2, 45)),
        contacts=np.zeros((count, 2, 16), dtype=bool),
        object_pose=pose[:, 0],
        object_angle=np.zeros(count),
        source=np.array(["by hand"] * count),
    )
    save_references(root / "references" / f"{name}.npz", references)


def test_references_are_counted(assets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Counts are per object, split and kind; only the paper's objects make up the splits' totals."""
    save_counted(assets, "box", ["articulate", "grasp", "grasp"], ["train", "train", "test"])
    save_counted(assets, "laptop", ["articulate"], ["train"])
    save_counted(assets, "tin", ["grasp"], ["train"])
    assert main(["list", "references", "--json"]) == 0
    counts = json.loads(capsys.readouterr().out)
    assert counts["splits"] == {"test": 1, "train": 3}
    assert counts["per_object"] == {
        "box": {"test": {"grasp": 1}, "train": {"articulate": 1, "grasp": 1}},
        "laptop": {"train": {"articulate": 1}},
    }
    assert counts["other_objects"]["tin"] == {"train": {"grasp": 1}}
    assert main(["list", "references"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines if "box" in line.split()] == [
        ["box", "test", "0", "articulate", "1", "grasp"],
        ["box", "train", "1", "articulate", "1", "grasp"],
    ]


def test_everything_is_listed(assets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a word all four lists appear, for people and for programs."""
    (assets / "objects").mkdir()
    (assets / "objects" / "tin.usda").write_text("#usda 1.0\n")
    (assets / "policies").mkdir()
    (assets / "policies" / "opener.pt").write_bytes(b"")
    assert main(["list"]) == 0
    text = capsys.readouterr().out
    assert all(f"{title}:\n" in text for title in ("Tasks", "Objects", "References", "Policies"))
    assert all(f"  {name}" in text for name in (*TASKS, *CURRICULA, "tin", "opener"))
    assert main(["list", "--json"]) == 0
    everything = json.loads(capsys.readouterr().out)
    assert set(everything) == {"tasks", "objects", "references", "policies"}
    assert everything["tasks"] == {name: each.description for name, each in (TASKS | CURRICULA).items()}
    assert "tin" in everything["objects"] and "opener" in everything["policies"]
    assert main(["list", "tasks", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == everything["tasks"]


def test_damaged_references_are_named(assets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that is no reference file ends the listing with its name."""
    (assets / "references").mkdir()
    (assets / "references" / "tin.npz").write_text("nothing")
    assert main(["list", "references"]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith("error: ") and "tin.npz" in captured.err
    assert captured.err.count("\n") == 1


def test_policies_are_found_by_path_or_name(assets: Path) -> None:
    """A path wins; a name is looked up among the assets; a misspelt one is suggested."""
    (assets / "policies").mkdir()
    own = assets / "policies" / "opener.pt"
    own.write_bytes(b"")
    assert asset_files("policies")["opener"] == own
    assert find_file("policies", "opener") == own
    assert find_file("policies", str(own)) == own
    with pytest.raises(UserError, match="unknown policy 'opner': did you mean 'opener'"):
        find_file("policies", "opner")
