"""Reference files: kept exactly, selected by split and kind, refused when malformed."""

import json
import pickle
from collections import Counter
from dataclasses import fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.references.reference import (
    ReferenceSet,
    describe_provenance,
    load_references,
    read_references,
    save_references,
)
from artigrasp.references.splits import in_split
from tests.example_references import box_references


def example(count: int = 4) -> ReferenceSet:
    """References with a value of its own in every place."""
    random = np.random.default_rng(0)
    poses = random.normal(size=(count, 3, 7))
    poses[..., 3:] /= np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    odd = np.arange(count) % 2 == 1
    return ReferenceSet(
        object="lidded-box",
        hand="open",
        kind=np.where(odd, "grasp", "articulate"),
        split=np.array(["train", "train", "test", "test"] * count)[:count],
        active=np.stack([odd, np.ones(count, bool)], axis=1),
        part=np.stack([0 * odd, ~odd], axis=1).astype(np.int32),
        wrist_pose_in_part=poses[:, :2].astype(np.float32),
        finger_angles=random.normal(size=(count, 2, 45)).astype(np.float32),
        contacts=random.random((count, 2, 16)) < 0.5,
        object_pose=poses[:, 2].astype(np.float32),
        object_angle=random.random(count).astype(np.float32),
        source=np.array([f"example {index}" for index in range(count)]),
        subject=np.where(np.arange(count) % 4 < 3, "s1", "s5"),
        sequence=np.array([f"box_use_{index:02d}" for index in range(count)]),
        frame=np.arange(count, dtype=np.int32),
        provenance=describe_provenance("test", seed=3),
    )


def arrays(path: Path, references: ReferenceSet) -> dict[str, Any]:
    """The arrays of a saved file."""
    save_references(path, references)
    with np.load(path) as archive:
        return dict(archive)


def test_file_keeps_everything(tmp_path: Path) -> None:
    """Reading gives back what was written, in the same types."""
    references = example()
    path = tmp_path / "references" / "lidded-box.npz"
    save_references(path, references)
    again = read_references(path)
    assert (again.object, again.hand, len(again)) == ("lidded-box", "open", 4)
    assert json.loads(again.provenance) == {"made_by": "test", "artigrasp": version("artigrasp"), "seed": 3}
    for name in (each.name for each in fields(ReferenceSet)[2:-1]):
        np.testing.assert_array_equal(getattr(again, name), getattr(references, name))
        assert getattr(again, name).dtype == getattr(references, name).dtype


def test_files_of_version_1_are_read(tmp_path: Path) -> None:
    """They do not say which recording they come from, so that no scheme has a split of them."""
    path = tmp_path / "old.npz"
    contents = arrays(path, example())
    later = ("subject", "sequence", "frame", "provenance")
    np.savez(path, **({name: contents[name] for name in contents if name not in later} | {"version": np.array(1)}))
    again = read_references(path)
    assert again.provenance == ""
    assert again.subject.tolist() == again.sequence.tolist() == [""] * 4 and again.frame.tolist() == [-1] * 4
    assert again.splits() == ("test", "train")
    np.testing.assert_array_equal(again.finger_angles, example().finger_angles)
    with pytest.raises(
        UserError, match="of 'by-subject/test': found none; there are test articulate, test grasp, train"
    ):
        again.select(split="by-subject/test")


def test_load_finds_by_object_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """References are found in the asset roots by the object's name."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    save_references(tmp_path / "references" / "drawer.npz", replace(example(), object="drawer"))
    assert load_references("drawer").object == "drawer"
    save_references(tmp_path / "references" / "chest.npz", replace(example(), object="drawer"))
    with pytest.raises(UserError, match=r"chest.npz: object: expected 'chest', found 'drawer'"):
        load_references("chest")
    with pytest.raises(UserError, match="unknown object 'drawers'"):
        load_references("drawers")


def test_select_by_split_kind_and_index() -> None:
    """Splits, kinds and indices narrow the set down together."""
    references = example(8)
    assert references.select(split="test").source.tolist() == [f"example {i}" for i in (2, 3, 6, 7)]
    assert references.select(split="test", kind="grasp").source.tolist() == ["example 3", "example 7"]
    assert references.select(kind="articulate", indices=[3, 0]).source.tolist() == ["example 6", "example 0"]
    assert len(references.select()) == 8


def test_schemes_part_the_same_references() -> None:
    """Each scheme parts what is given to training and testing by whole subjects or recordings; the rest is in none."""
    references = example(8)
    references = replace(references, split=np.array([*references.split[:6], "recon", "recon-mocap"]))
    assert references.splits()[:4] == ("recon", "recon-mocap", "test", "train")
    for scheme in ("by-subject", "by-sequence"):
        parts = [references.select(split=f"{scheme}/{part}").source.tolist() for part in ("train", "test")]
        assert sorted(parts[0] + parts[1]) == [f"example {index}" for index in range(6)]
    assert set(references.select(split="by-subject/test").subject) == {"s5"}
    assert "s5" not in references.select(split="by-subject/train").subject
    unknown = replace(references, subject=np.array([""] * 8))
    assert unknown.splits() == ("recon", "recon-mocap", "test", "train")


def test_sequences_are_parted_by_their_names_alone() -> None:
    """A recording is in the same part in whatever company, with all its references; about a third is for the test."""
    subject = np.repeat([f"s{number}" for number in range(1, 11)], 60)
    sequence = np.tile(np.repeat([f"laptop_use_{number:02d}" for number in range(20)], 3), 10)
    given_split = np.where(np.arange(600) % 2, "train", "test")
    test = in_split("by-sequence/test", given_split, subject, sequence)
    assert 0.25 < test.mean() < 0.42
    counts = Counter(zip(subject.tolist(), sequence.tolist(), test.tolist(), strict=True))
    assert len(counts) == 200
    some = np.random.default_rng(0).permutation(600)[:50]
    np.testing.assert_array_equal(
        in_split("by-sequence/test", given_split[some], subject[some], sequence[some]), test[some]
    )


def test_has_tells_what_select_would_find() -> None:
    """A split that there is, of kinds of which one is enough."""
    references = box_references(test_count=1)
    assert references.has("test", "articulate") and references.has("train", ("grasp", "articulate"))
    assert not references.has("test", ("grasp",)) and not references.has("recon", "articulate")


def test_select_of_nothing_says_what_there_is() -> None:
    """An empty selection and an index out of range are errors that name what there is."""
    with pytest.raises(UserError, match="lidded-box: references of 'recon': found none; there are test articulate, "):
        example().select(split="recon")
    with pytest.raises(UserError, match="'recon' of 'articulate' or 'grasp' of the left hand: found none"):
        example().select(split="recon", kind=("articulate", "grasp"), hands=["left"])
    with pytest.raises(UserError, match="expected indices from 0 to 1, found 2"):
        example().select(split="train", indices=[0, 2])


def set_at(index: Any, value: Any) -> Any:
    """A change that puts a value at a place of an array."""

    def change(array: np.ndarray) -> np.ndarray:
        array = array.copy()
        array[index] = value
        return array

    return change


@pytest.mark.parametrize(
    ("field", "change", "message"),
    [
        ("finger_angles", set_at((2, 1, 7), np.nan), "finger_angles[2, 1, 7]: expected a finite number, found nan"),
        ("object_angle", set_at(3, np.inf), "object_angle[3]: expected a finite number, found inf"),
        ("object_pose", set_at((1, 6), 5.0), "object_pose[1]: expected a unit quaternion"),
        ("object_pose", set_at((1, 0), -90.0), "object_pose[1, 0]: expected at most 10 m either way, found -90"),
        ("wrist_pose_in_part", set_at((2, 0, 1), 235.0), "wrist_pose_in_part[2, 0, 1]: expected at most 10 m either"),
        ("finger_angles", set_at((1, 0, 3), 45.0), "finger_angles[1, 0, 3]: expected at most 6.28 rad either way"),
        ("kind", set_at(1, "throw"), "kind[1]: expected one of articulate, grasp, found throw"),
        ("part", set_at((0, 1), 2), "part[0, 1]: expected one of 0, 1, found 2"),
        ("active", set_at(2, False), "active[2]: expected at least one active hand, found none"),
        ("contacts", lambda array: array[:, :, :15], "contacts: expected shape (R=4, 2, 16), found (4, 2, 15)"),
        ("split", lambda array: array[:3], "split: expected shape (R=4), found (3,)"),
        ("active", lambda array: array.astype(float), "active: expected booleans"),
        ("hand", lambda array: np.array(3), "hand: expected strings"),
        ("version", lambda array: np.array(4), "version: expected at most 3, found 4"),
        ("provenance", lambda array: np.array(["a", "b"]), "provenance: expected shape (), found (2,)"),
        ("subject", lambda array: array[:2], "subject: expected shape (R=4), found (2,)"),
        ("frame", lambda array: array + 0.5, "frame: expected whole numbers"),
        ("format", lambda array: np.array("artigrasp.motion"), "format: expected 'artigrasp.references'"),
    ],
)
def test_malformed_field_is_named(field: str, change: Any, message: str, tmp_path: Path) -> None:
    """Whatever is wrong, one line names the file, the field and the place."""
    path = tmp_path / "bad.npz"
    contents = arrays(path, example())
    np.savez(path, **(contents | {field: change(contents[field])}))
    with pytest.raises(UserError, match=r"^[^\n]*$") as caught:
        read_references(path)
    assert str(path) in str(caught.value) and message in str(caught.value)


def test_missing_field_is_named(tmp_path: Path) -> None:
    """A field that is not there is named."""
    path = tmp_path / "bad.npz"
    contents = arrays(path, example())
    del contents["contacts"]
    np.savez(path, **contents)
    with pytest.raises(UserError, match="contacts: expected an array, found none"):
        read_references(path)


def test_pickles_are_refused(tmp_path: Path) -> None:
    """Neither an archive with Python objects nor a bare pickle is read."""
    path = tmp_path / "bad.npz"
    contents = arrays(path, example())
    np.savez(path, **(contents | {"kind": contents["kind"].astype(object)}))
    with pytest.raises(UserError, match="archive of plain arrays"):
        read_references(path)
    path.write_bytes(pickle.dumps(contents))
    with pytest.raises(UserError, match="archive of plain arrays"):
        read_references(path)


def test_archive_that_unpacks_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small file that unpacks to a large one is refused before it is unpacked."""
    monkeypatch.setattr("artigrasp.arrays.MAX_BYTES", 10_000)
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, **(arrays(path, example()) | {"more": np.zeros(100_000)}))
    with pytest.raises(UserError, match="expected at most 10000 bytes, found"):
        read_references(path)
