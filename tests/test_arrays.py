"""Tests of reading named arrays strictly."""

from pathlib import Path

import numpy as np
import pytest

from artigrasp.arrays import check_array, check_poses, load_arrays, save_arrays
from artigrasp.errors import UserError


def test_arrays_come_back(tmp_path: Path) -> None:
    """Numbers, booleans and strings are read as they were written."""
    arrays = {"count": np.arange(3), "active": np.asarray([True, False]), "kind": np.asarray(["grasp", "articulate"])}
    save_arrays(tmp_path / "a.npz", "artigrasp.test", 1, arrays)
    loaded = load_arrays(tmp_path / "a.npz", "artigrasp.test", 1)
    assert loaded.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(loaded[name], array)
    with pytest.raises(UserError, match="newer version"):
        load_arrays(tmp_path / "a.npz", "artigrasp.test", 0)


def test_pickles_are_not_loaded(tmp_path: Path) -> None:
    """An array of Python objects is refused before anything in it is looked at."""
    np.savez(tmp_path / "a.npz", format="artigrasp.test", version=1, a=np.asarray([{}]))
    with pytest.raises(UserError, match="Object arrays cannot be loaded"):
        load_arrays(tmp_path / "a.npz", "artigrasp.test", 1)


def test_named_axes_agree() -> None:
    """The first array with a named axis sets its size for those that follow."""
    sizes: dict[str, int] = {}
    assert check_array("angle", [[1, 2], [3, 4]], ("R", 2), np.float32, sizes).dtype == np.float32
    assert sizes == {"R": 2}
    with pytest.raises(ValueError, match=r"part: expected shape \(R=2\), found \(3,\)"):
        check_array("part", [0, 1, 1], ("R",), np.int64, sizes)
    with pytest.raises(ValueError, match="part: expected whole numbers, found an array of float64"):
        check_array("part", [0.5, 1], ("R",), np.int64, sizes)


def test_quaternions_are_unit() -> None:
    """The message names the first pose whose quaternion is none."""
    poses = np.zeros((2, 3, 7))
    poses[..., 6] = 1
    check_poses("pose", poses, ("R", 3))
    poses[1, 2, 6] = 0.9
    with pytest.raises(ValueError, match=r"pose\[1, 2\]: expected a unit quaternion"):
        check_poses("pose", poses, ("R", 3))


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("width", [1, 3])
def test_characters_are_characters(width: int, order: str) -> None:
    """Of what is none NumPy makes strings that break later, or a ``SystemError``, by how many there are."""
    whole = np.array(["a\U0010ffff", ""], dtype=f"{order}U{width + 1}")
    np.testing.assert_array_equal(check_array("names", whole, (2,), np.str_), whole)
    damaged = np.full(2 * width, 0x110000, np.uint32).astype(f"{order}u4").view(f"{order}U{width}")
    with pytest.raises(ValueError, match="names: expected strings, found characters that are none: 0x110000"):
        check_array("names", damaged, (2,), np.str_)
