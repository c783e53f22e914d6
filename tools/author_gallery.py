"""Author the gallery: a page of pictures of the open objects, and of motions on those that have references.

    python tools/author_gallery.py [OBJECT…]

makes the pictures of these objects anew, by default of all, in ``docs/images/gallery``, and writes ``docs/gallery.md``
about all pictures that are there. Nothing of ARCTIC is shown: only what is shipped.
"""

import argparse
import os
import tempfile
from pathlib import Path

from artigrasp.kernels.layout import HANDS

FOLDER = Path(__file__).parents[1]
IMAGES = FOLDER / "docs" / "images" / "gallery"
PAGE = FOLDER / "docs" / "gallery.md"

OBJECTS = (
    "lidded-box",
    "open-box",
    "open-espresso-machine",
    "open-ketchup-bottle",
    "open-laptop",
    "open-microwave",
    "open-mixer",
    "open-notebook",
    "open-scissors",
    "open-waffle-iron",
)
ACTING = {
    "lidded-box": ["--policy", "lidded-box"],
    "open-scissors": ["--split", "train", "--controller", "pd-ik", "--task", "right-free-replay", "--search", "16"],
}
"""By what an object is opened; the others by a search from their first test reference."""
SEARCH = 16
ANGLE, SHARE = 1.0, 0.7
"""Angle to open to [rad], and at most which share of the hinge's range."""
SIZE, RATE = (320, 288), 12
"""Of a video [px], with its caption, and its pictures per second."""
STILL = 240
"""Width and height of a still picture [px]."""


def main() -> None:
    """Make the pictures, then the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", nargs="*", metavar="OBJECT")
    objects = parser.parse_args().objects or OBJECTS
    # Only what is shipped.
    os.environ["ARTIGRASP_ASSETS"] = tempfile.mkdtemp()
    from artigrasp.cli.warp_start import start_warp

    start_warp()
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in objects:
        run(["render", "objects", name, "--out", str(IMAGES / f"{name}-object.webp"), "--size", str(STILL)])
        if has_articulations(name):
            with tempfile.TemporaryDirectory() as folder:
                for words in commands(name, f"{folder}/motion.npz", str(IMAGES / f"{name}.webp")):
                    run(words)
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


def has_articulations(name: str) -> bool:
    """Whether an object has test references to open it."""
    from artigrasp.errors import UserError
    from artigrasp.references.reference import load_references

    try:
        return len(load_references(name).select(split="test", kind="articulate")) > 0
    except UserError:
        return False


def commands(name: str, motion: str, picture: str) -> tuple[list[str], list[str]]:
    """The words that generate a motion on an object, and that show it."""
    from artigrasp.assets.object import load_object
    from artigrasp.references.reference import load_references

    reference = load_references(name).select(split="test", kind="articulate", indices=0)
    # an idle left hand would only be in the way of the picture
    task = "both-free" if reference.active[0, HANDS.index("left")] else "right-free-replay"
    angle = min(ANGLE, round(SHARE * load_object(name).hinge_upper, 2))
    acting = ACTING.get(name, ["--task", task, "--search", str(SEARCH)])
    made = ["generate", "--object", name, *acting, "--target-angle", f"{angle:g}", "--out", motion]
    shown = ["render", "motion", motion, "--out", picture, "--target", "--fps", str(RATE)]
    return made, [*shown, "--width", str(SIZE[0]), "--height", str(SIZE[1])]


def run(words: list[str]) -> None:
    """Run `artigrasp` with these words, or stop."""
    from artigrasp.cli import main as artigrasp

    if artigrasp(words) != 0:
        raise SystemExit(f"failed: artigrasp {' '.join(words)}")


def page() -> str:
    """The page about all pictures that are there."""
    lines = [
        "# Gallery",
        "",
        "The objects that come with the package: closed, half open and open, and moved where there are references.",
        "`python tools/author_gallery.py` makes this page and its pictures; with names of objects, theirs only.",
        "",
        "## The open hand",
        "",
        "![The open hand spread, at rest and as a fist, from either side, and the links that collide]"
        "(images/open-hand.webp)",
        "",
        "`python -m tools.picture_hand docs/images/open-hand.webp` makes it.",
    ]
    for name in OBJECTS:
        if not (IMAGES / f"{name}-object.webp").exists():
            continue
        lines += ["", f"## {name}", "", f"![{name}: closed, half open, open](images/gallery/{name}-object.webp)"]
        if (IMAGES / f"{name}.webp").exists():
            made, shown = commands(name, "motion.npz", f"{name}.webp")
            lines += [
                "",
                f"![{name} is opened; the ghost is the target](images/gallery/{name}.webp)",
                "",
                "```sh",
                f"artigrasp {' '.join(made)}",
                f"artigrasp {' '.join(shown)}",
                "```",
            ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
