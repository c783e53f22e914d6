"""The verb that extracts references from recordings."""

import json
from pathlib import Path

import pytest
from PIL import Image

from artigrasp.cli import main
from tests.references.recording_example import write_assets, write_recording


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the data with one recording, its assets imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "assets"))
    write_assets(tmp_path / "assets")
    return write_recording(tmp_path / "data", "release")


def test_references_are_written_and_counted(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """For people and for programs; options reach the rules."""
    assert main(["extract-references", str(root), "--test-fraction", "0"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"wrote {Path('extracted/references/box.npz')}"
    assert lines[1].split() == ["box", "train", "1", "articulate", "1", "grasp"]
    assert lines[2] == "2 references from 1 recordings"
    words = ["extract-references", str(root), "--out", "other", "--json", "--objects", "box", "--subjects", "s1"]
    assert main([*words, "--base-speed", "5", "--test-fraction", "1"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "files": [str(Path("other/references/box.npz"))],
        "recordings": 1,
        "references": {"box": {"test": {"articulate": 1}}},
    }


def test_a_recording_is_drawn(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing else is written; a picture is replaced without asking, as it holds no work."""
    for _ in range(2):
        assert main(["extract-references", str(root), "--plot", "s1/box_use_01", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["files"] == [str(Path("extracted/s1_box_use_01.png"))]
    assert [path.name for path in Path("extracted").iterdir()] == ["s1_box_use_01.png"]
    with Image.open("extracted/s1_box_use_01.png") as picture:
        assert picture.width > 1000 and len(picture.convert("RGB").getcolors(1 << 20) or []) > 50


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "nowhere: expected ARCTIC as"),
        (["data", "--plot", "box_use_01"], "--plot box_use_01: expected a recording such as s1/box_use_01: expected a"),
        (["data", "--plot", "s1/../../box_use_01"], "expected a sequence of the object"),
        (["data", "--plot", "s2/box_use_01"], "expected the recording box_use_01 of s2, found none"),
        (["data", "--pause", "-1"], "pause: expected zero or a positive number, found -1.0"),
        (["data", "--tasks", "right_arty"], "unknown task 'right_arty': did you mean 'right_arti'?"),
        (["data", "--out", "data/rsc/arctic/box/box.urdf"], "box.urdf: expected a folder to write to, found a file"),
    ],
)
def test_bad_usage_is_one_line(words: list[str], message: str, root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It exits with 2 and writes nothing."""
    assert main(["extract-references", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and message in captured.err
    assert not Path("extracted").exists()
