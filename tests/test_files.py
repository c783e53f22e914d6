"""Tests of writing whole files and of recognising them."""

import errno
import os
import shutil
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.files import (
    LEFTOVER_AGE,
    atomic_write,
    check_format,
    check_target,
    read_json,
    remove_leftovers,
    write_json,
)


def test_atomic_write_renames_when_whole(tmp_path: Path) -> None:
    """The file appears under its name, in folders that did not exist, with nothing left beside it."""
    target = tmp_path / "new" / "numbers.npz"
    with atomic_write(target) as temporary:
        assert temporary.parent == target.parent and temporary.suffix == ".npz"
        np.savez(temporary, a=np.arange(3))
        assert not target.exists()
    assert list(target.parent.iterdir()) == [target]
    np.testing.assert_array_equal(np.load(target, allow_pickle=False)["a"], [0, 1, 2])


def test_atomic_write_keeps_the_old_file_on_failure(tmp_path: Path) -> None:
    """A block that raises leaves the old content and no temporary file."""
    target = tmp_path / "note.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), atomic_write(target) as temporary:
        temporary.write_text("ne")
        raise RuntimeError("half way")
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_json_has_finite_numbers(tmp_path: Path) -> None:
    """What is written is read back; numbers that JSON does not have leave the old file as it was."""
    target, content = tmp_path / "note.json", {"format": "artigrasp.note", "version": 1, "size": 0.5}
    write_json(target, content)
    with pytest.raises(ValueError, match="JSON"):
        write_json(target, {**content, "size": float("nan")})
    assert read_json(target, "artigrasp.note", 1, "a note") == {"size": 0.5}


@pytest.mark.parametrize(
    ("error", "free"),
    [(OSError(errno.ENOSPC, "No space left on device"), 1 << 30), (RuntimeError("unexpected pos 64 vs 0"), 0)],
)
def test_atomic_write_tells_that_a_disk_is_full(
    error: Exception, free: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the library that writes says so or fails in a way of its own; the old file stays."""
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))
    target = tmp_path / "policy.pt"
    target.write_text("old")
    with pytest.raises(UserError, match=r"policy.pt: cannot write this file: no space left"), atomic_write(target):
        raise error
    assert target.read_text() == "old"


def test_atomic_write_refuses_impossible_places(tmp_path: Path) -> None:
    """A folder in the file's place, or a file in the folder's place, is the user's mistake."""
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file" / "x.txt", tmp_path / "file" / "deeper" / "x.txt"):
        with pytest.raises(UserError, match=r"file: expected a folder to write to, found a file"), atomic_write(path):
            pass
    with pytest.raises(UserError, match="found a folder"), atomic_write(tmp_path):
        pass


def test_a_target_can_be_checked_beforehand(tmp_path: Path) -> None:
    """What could be written passes, and nothing is made; what could not is refused."""
    check_target(tmp_path / "new" / "folder" / "x.txt")
    assert not list(tmp_path.iterdir())
    with pytest.raises(UserError, match="found a folder"):
        check_target(tmp_path)


def test_leftovers_of_killed_processes_are_removed(tmp_path: Path) -> None:
    """Old temporary files go, in folders below too; those that may be in use and all other files stay."""
    names = []
    for target in (tmp_path / "a.npz", tmp_path / "deeper" / "b.tar.gz", tmp_path / "c"):
        with atomic_write(target) as temporary:
            temporary.write_text("whole")
        names.append(temporary)
    others = [tmp_path / ".hidden", tmp_path / ".a.0123456z.npz", tmp_path / "a.01234567.npz"]
    for age in (0.0, LEFTOVER_AGE + 60):
        for path in (*names, *others):
            path.write_text("half")
            os.utime(path, (time.time() - age,) * 2)
        remove_leftovers(tmp_path)
        assert all(path.exists() for path in others)
        assert all(path.exists() == (age == 0) for path in names)
    assert (tmp_path / "a.npz").exists()


def test_check_format_accepts_own_files() -> None:
    """The format at this or an older version passes, also as the arrays that np.load returns."""
    check_format("artigrasp.motion", 1, "artigrasp.motion", 2, "m.npz")
    check_format(np.array("artigrasp.motion"), np.array(2), "artigrasp.motion", 2, "m.npz")


@pytest.mark.parametrize(
    ("found_format", "found_version", "message"),
    [
        (None, None, "m.npz: format: expected 'artigrasp.motion', found none"),
        ("artigrasp.references", 1, "m.npz: format: expected 'artigrasp.motion', found 'artigrasp.references'"),
        ("artigrasp.motion", "new", "m.npz: version: expected a whole number from 1, found 'new'"),
        ("artigrasp.motion", 0, "m.npz: version: expected a whole number from 1, found '0'"),
        ("artigrasp.motion", 3, "m.npz: version: expected at most 2, found 3: a newer version"),
    ],
)
def test_check_format_refuses_other_files(found_format: object, found_version: object, message: str) -> None:
    """Another format, no version or a newer one is refused by name."""
    with pytest.raises(UserError) as caught:
        check_format(found_format, found_version, "artigrasp.motion", 2, "m.npz")
    assert str(caught.value).startswith(message)
