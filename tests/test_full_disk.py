"""A disk without room: one line, and what was there before is still there."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from artigrasp.assets.hand import load_hand, write_hand
from artigrasp.assets.object import load_object, write_object
from artigrasp.config import write_task
from artigrasp.errors import UserError
from artigrasp.motion.file import save_motion
from artigrasp.references.reference import load_references, save_references
from tests.evaluation.examples import TASK
from tests.motion.example import example_motion

WRITERS: dict[str, Callable[[Path], None]] = {
    "motion.npz": lambda path: save_motion(path, example_motion(sample_count=50)),
    "references.npz": lambda path: save_references(path, load_references("lidded-box")),
    "object.usda": lambda path: write_object(replace(load_object("lidded-box"), path=path)),
    "hand.usda": lambda path: write_hand(replace(load_hand("open", "right"), path=path, skin=None)),
    "task.json": lambda path: write_task(path, TASK),
}


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond this size [bytes]."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize("name", WRITERS)
def test_what_finds_no_room_leaves_everything_as_it_was(name: str, tmp_path: Path) -> None:
    """One line names the file; the old one stays, and nothing is left beside it."""
    path = tmp_path / name
    path.write_text("older")
    with room_for(500), pytest.raises(UserError, match=f"{name}: cannot write this file: no space left on its disk"):
        WRITERS[name](path)
    assert path.read_text() == "older" and list(tmp_path.iterdir()) == [path]
    WRITERS[name](path)
    assert path.stat().st_size > 500
