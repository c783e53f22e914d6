"""Story files: what they say, and how mistakes in them are told."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from artigrasp.assets.library import asset_files, find_file
from artigrasp.config.story import CloseStep, MoveStep, OpenStep, ReleaseStep, describe_step
from artigrasp.errors import UserError
from artigrasp.stories.file import read_story

STORY: dict[str, Any] = {
    "format": "artigrasp.story",
    "version": 1,
    "objects": {"box": {"asset": "open-box", "at": [0, 0]}, "jar": {"asset": "open-ketchup-bottle", "at": [0.4, 0]}},
    "steps": [
        {"open": "box", "to": 1.5, "hand": "left", "hold": True},
        {"move": "jar", "to": [0.1, 0, 0.1], "relative_to": "box", "drop": 0.1},
        {"release": "left"},
        {"close": "box"},
    ],
}


def read(folder: Path, text: str) -> Any:
    """The story of a text."""
    (folder / "story.yaml").write_text(text, encoding="utf-8")
    return read_story(folder / "story.yaml")


def test_every_kind_of_step_is_known_by_its_verb(tmp_path: Path) -> None:
    """Defaults are filled in, whole numbers are numbers, and objects keep their order."""
    story = read(tmp_path, yaml.safe_dump(STORY, sort_keys=False))
    assert list(story.objects) == ["box", "jar"] and story.objects["box"].at == (0.0, 0.0)
    assert story.steps == (
        OpenStep(open="box", to=1.5, hand="left", hold=True),
        MoveStep(move="jar", to=(0.1, 0.0, 0.1), relative_to="box", drop=0.1),
        ReleaseStep(release="left"),
        CloseStep(close="box"),
    )
    assert [describe_step(step) for step in story.steps] == ["open box", "move jar", "release left", "close box"]


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        (("steps", 0, "hnad"), "left", "steps[0].hnad: unknown key: did you mean 'hand'?"),
        (("steps", 0, "to"), "wide", "steps[0].to: expected a number, found 'wide'"),
        (("steps", 0, "hand"), "middle", "steps[0].hand: expected one of 'left', 'right', found 'middle'"),
        (("steps", 0, "open"), "boxx", "steps[0].open: unknown object 'boxx': did you mean 'box'?"),
        (("steps", 1, "relative_to"), "jar", "steps[1].relative_to: expected another object, found 'jar'"),
        (("steps", 1, "to"), [0, 0], "steps[1].to: expected a list of 3 values, found [0, 0]"),
        (("steps", 1, "drop"), -1, "steps[1].drop: expected zero or a positive number, found -1"),
        (("steps", 3), {"clse": "box"}, "steps[3].clse: unknown key: did you mean 'close'?"),
        (("steps", 3), {"open": "box", "close": "box"}, "expected one of the keys open, close, move, release, found"),
        (("steps", 3), "close box", "expected one of the keys open, close, move, release, found 'close box'"),
        (("steps",), [], "steps: expected at least one, found none"),
        (("objects", "box"), {"asset": "open-box"}, "objects.box.at: expected a value, found none"),
        (("objects", "box", "colour"), "red", "objects.box.colour: unknown key"),
        (("objects",), ["box"], "objects: expected a table of keys and values, found ['box']"),
        (("version",), 2, "version"),
        (("format",), "artigrasp.motion", "format"),
    ],
)
def test_mistakes_are_told_by_their_key(tmp_path: Path, path: tuple[Any, ...], value: object, expected: str) -> None:
    """In one line, with what was expected and the nearest name."""
    content = yaml.safe_load(yaml.safe_dump(STORY))
    place = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(UserError) as caught:
        read(tmp_path, yaml.safe_dump(content))
    assert str(caught.value).startswith(str(tmp_path)) and expected in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "- 1",
        "a: [",
        "? [1, 2]\n: 3",
        "version: 1\nversion: 1",
        "!!python/object/apply:os.system ['false']",
        "a: &a [*a]",
        "\x00",
        "a: " + "[" * 2000,
    ],
)
def test_other_texts_are_refused(tmp_path: Path, text: str) -> None:
    """Nothing is run, no key is overwritten, and there is no traceback."""
    with pytest.raises(UserError, match=r"story\.yaml"):
        read(tmp_path, text)


def test_stories_are_found_by_path_and_by_name(tmp_path: Path) -> None:
    """The shipped ones can all be read."""
    for name, path in asset_files("stories").items():
        assert find_file("stories", name) == path and read_story(path).steps
    with pytest.raises(UserError, match="did you mean 'ketchup-into-box'"):
        find_file("stories", "ketchup-in-box")
    with pytest.raises(UserError, match="cannot read this file"):
        read_story(tmp_path / "none.yaml")
