"""Tests of `artigrasp render`: files that were asked for, JSON, and one line for what cannot be."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artigrasp.cli import main
from artigrasp.motion.file import save_motion
from tests.motion.example import example_motion

SMALL = ["--width", "48", "--height", "48", "--grid", "1", "--links"]


@pytest.fixture
def motion(work: Path) -> Path:
    """A motion file in the user's folder."""
    save_motion(work / "motion.npz", example_motion(hands=("left", "right")))
    return work / "motion.npz"


def test_references(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A sheet of some references of an object, told as JSON."""
    words = ["lidded-box", "--split", "train", "--indices", "0", "2", "--size", "40", "--views", "1", "--json"]
    assert main(["render", "references", *words]) == 0
    assert json.loads(capsys.readouterr().out) == {"path": "references.png", "references": {"lidded-box": 2}}
    with Image.open(work / "references.png") as image:
        assert image.width % 46 == 0


@pytest.mark.parametrize(("name", "size"), [("a.mp4", None), ("a.webp", (48, 48)), ("a.png", (96, 48))])
def test_motion(name: str, size: tuple[int, int] | None, motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ending decides between a video and a sheet of frames."""
    words = [str(motion), "--out", name, *SMALL, "--frames", "2", "--camera", "orbit", "--target", "--no-caption"]
    assert main(["render", "motion", *words]) == 0
    assert capsys.readouterr().out == f"wrote {name}\n"
    path = motion.parent / name
    assert path.stat().st_size > 100
    if size is not None:
        with Image.open(path) as image:
            assert image.size == size


def test_transparent_sheet(motion: Path) -> None:
    """A transparent sheet has clear and opaque places."""
    assert main(["render", "motion", str(motion), "--out", "a.png", *SMALL, "--frames", "1", "--transparent"]) == 0
    opacity = np.asarray(Image.open(motion.parent / "a.png"))[..., 3]
    assert opacity.min() == 0 and opacity.max() == 255


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["references"], "expected the names of one or more objects"),
        (["references", "liddedbox"], "unknown object 'liddedbox': did you mean 'lidded-box'"),
        (["references", "lidded-box", "--split", "tests"], "found none; there are"),
        (["references", "lidded-box", "--indices", "99"], "expected indices from 0 to"),
        (["references", "lidded-box", "--out", "a.mp4"], "a.mp4: expected a name that ends in .png"),
        (["motion", "nothing.npz"], "nothing.npz: no such file"),
        (["motion", "motion.npz", "--out", "a.txt"], "a.txt: expected a name that ends in"),
        (["motion", "motion.npz", "--transparent"], "expected a transparent picture that ends in .webp"),
        (["motion", "motion.npz", "--fps", "0"], "fps: expected 1 to 120 frames per second, found 0"),
        (["motion", "motion.npz", "--out", "a.png", "--frames", "0"], "frames: expected at least 1, found 0"),
        (["motion", "motion.npz", "--out", "a.png", "--columns", "0"], "columns: expected at least 1, found 0"),
        (["motion", "motion.npz", "--width", "100000"], "width: expected 16 to 8192 pixels, found 100000"),
        (["motion", "motion.npz", "--width", "0"], "width: expected 16 to 8192 pixels, found 0"),
        (["motion", "motion.npz", "--fps", "nan"], "fps: expected 1 to 120 frames per second, found nan"),
    ],
)
def test_what_cannot_be(words: list[str], message: str, motion: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Mistakes end in one line and code 2, and leave nothing."""
    before = sorted(motion.parent.rglob("*"))
    assert main(["render", *words]) == 2
    error = capfd.readouterr().err.strip().splitlines()
    assert len(error) == 1 and message in error[0]
    assert sorted(motion.parent.rglob("*")) == before
