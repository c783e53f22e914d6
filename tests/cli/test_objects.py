"""Tests of `artigrasp make-object`, `import-object` and `render objects`."""

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
from PIL import Image

from artigrasp.assets.object import load_object
from artigrasp.cli import main

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of a user who has no assets but those that are shipped."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "assets"))
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_guide_does_what_it_says(user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every command of docs/objects.md runs, but those that learn or need references, and the toolbox is known then."""
    (user / "docs").mkdir()
    shutil.copytree(DOCS / "examples", user / "docs" / "examples")
    blocks = re.findall(r"```sh\n(.*?)```", (DOCS / "objects.md").read_text(), flags=re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines() if line.strip()]
    ran = []
    for line in lines:
        program, verb, *words = shlex.split(line, comments=True)
        assert program in ("artigrasp", "export")
        if verb in ("make-object", "import-object", "check-asset", "list"):
            assert main([verb, *words]) == 0, line
            ran.append(verb)
    assert {"make-object", "import-object", "check-asset"} <= set(ran)
    assert "found none" not in capsys.readouterr().err
    assert load_object("toolbox").parts[0].mass == pytest.approx(0.9)


def test_made_object_is_told_as_json(user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Values, their ranges and where these come from."""
    assert main(["make-object", "laptop", "--seed", "1000", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["name"], told["split"]) == ("open-laptop-1000", "unseen")
    assert Path(told["path"]).is_file()
    width = told["ranges"]["width"]
    assert width["low"] <= told["values"]["width"] <= width["high"] and width["unit"] == "m" and width["source"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["make-object", "labtop"], "unknown category 'labtop': did you mean 'laptop'"),
        (["make-object", "laptop", "--seed", "-1"], "seed: expected 0 to"),
        (["make-object", "laptop", "--out", "a.obj"], "a.obj: expected a name that ends in .usda"),
        (["import-object", "nothing.urdf"], "nothing.urdf: cannot read this file"),
        (["import-object", "a.urdf", "--name", "open-thing"], "name: expected lower-case letters"),
        (["import-object", "a.urdf", "--density", "0"], "density: expected 1 to 20000"),
        (["render", "objects"], "expected the names of one or more objects"),
        (["render", "objects", "open-laptop", "--openings", "2"], "openings: expected numbers from 0 to 1"),
        (["check-asset", "a.urdf"], "a.urdf: expected a file that ends in .usda; artigrasp import-object makes"),
    ],
)
def test_mistakes_are_told_in_one_line(
    words: list[str], message: str, user: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, and what to mend."""
    assert main(words) == 2
    assert message in capsys.readouterr().err
    assert not list(user.glob("*.usda"))


def test_sheet_of_objects(user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Pictures side by side, also of a variant that is not shipped."""
    words = ["lidded-box", "open-notebook-5", "--openings", "0", "1", "--size", "40", "--columns", "2", "--json"]
    assert main(["render", "objects", *words]) == 0
    assert json.loads(capsys.readouterr().out) == {"path": "objects.png", "objects": ["lidded-box", "open-notebook-5"]}
    with Image.open(user / "objects.png") as image:
        assert image.width == 160
