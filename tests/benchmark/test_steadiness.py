"""Physics that holds: objects rest, hands press without sinking in, and what is held stays where it is held."""

from dataclasses import replace
from pathlib import Path

import pytest

from artigrasp.assets.object import load_object
from artigrasp.assets.object_usd import write_object
from artigrasp.benchmark.steadiness import CARRYING_GAINS, PHYSICS, hold_slip, press_depth, rest_drift
from artigrasp.references.reference import ReferenceSet, load_references

ARCTIC = ("box", "laptop")
"""What the tests import."""


def references(name: str, kind: str | None = None, indices: tuple[int, ...] = (0, -1)) -> ReferenceSet:
    """A few references of an object."""
    found = load_references(name).select(kind=kind)
    return found.select(indices=[index % len(found) for index in indices])


def assert_rests(name: str) -> None:
    """From t = 0.5 s on an object moves by less than 1 mm and 0.01 rad in 5 s, but for a hinge that gravity turns."""
    drift = rest_drift(references(name))
    assert not drift.failed.any()
    assert drift.distance.max() < 1e-3
    assert drift.turn.max() < 0.01
    assert drift.hinge_unexplained.max() < 0.01


def test_the_box_rests() -> None:
    """The shipped box."""
    assert_rests("lidded-box")


@pytest.mark.usefixtures("arctic_assets")
@pytest.mark.parametrize("name", ARCTIC)
def test_imported_objects_rest(name: str) -> None:
    """Objects with many collision pieces, in poses that the recordings show."""
    assert_rests(name)


def assert_presses(pressed: ReferenceSet) -> None:
    """Hands with the paper's gains neither explode nor sink in by more than 2 mm, at first or for good."""
    depth = press_depth(pressed)
    assert not (depth.failed | depth.began_inside).any()
    assert depth.force.min() > 2.0, "the hands should press"
    assert depth.peak.max() < 2e-3
    assert depth.steady.max() < 1e-3


def test_a_hand_presses_on_the_box() -> None:
    """The shipped hand on the shipped box."""
    assert_presses(references("lidded-box", "articulate"))


@pytest.mark.usefixtures("arctic_assets")
@pytest.mark.parametrize("name", ARCTIC)
def test_a_hand_presses_on_imported_objects(name: str) -> None:
    """MANO's hand."""
    assert_presses(references(name, "articulate"))


def assert_holds(grasps: ReferenceSet, squeeze: float) -> None:
    """Held in the air by nothing but fingers, an object slips by less than 2 mm in 5 s, and its lid does not rattle."""
    hold = hold_slip(grasps, squeeze=squeeze)
    print(f"gains {CARRYING_GAINS}, friction {PHYSICS.friction}, slip {1000 * hold.slip} mm")
    assert hold.held.all()
    assert hold.slip.max() < 2e-3
    assert hold.hinge_jitter.max() < 0.05


def test_two_hands_hold_the_box() -> None:
    """The shipped grasps were made for fingers that squeeze."""
    assert_holds(references("lidded-box", "grasp", (2, 4, 9)), squeeze=0.3)


@pytest.mark.usefixtures("arctic_assets")
@pytest.mark.parametrize(("name", "indices"), [("box", (1, 13)), ("laptop", (5, 16))])
def test_two_hands_hold_imported_objects(name: str, indices: tuple[int, ...]) -> None:
    """The references' own fingers suffice."""
    assert_holds(references(name, "grasp", indices), squeeze=0.0)


@pytest.fixture
def feather_lid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shipped box with a lid of 5.6 g, as light as the cap of ARCTIC's ketchup bottle."""
    box = load_object("lidded-box")
    base, lid = box.parts
    lighter = 0.0056 / lid.mass
    lid = replace(lid, mass=lid.mass * lighter, inertia=lid.inertia * lighter)
    write_object(replace(box, path=tmp_path / "objects" / "lidded-box.usda", parts=(base, lid)))
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    assert load_object("lidded-box").parts[1].mass == pytest.approx(0.0056)


@pytest.mark.usefixtures("feather_lid")
def test_a_lid_of_five_grams_is_steady() -> None:
    """At rest, under a pressing hand, and while the box is held in the air."""
    assert_rests("lidded-box")
    assert_presses(references("lidded-box", "articulate"))
    assert_holds(references("lidded-box", "grasp", (2, 4, 9)), squeeze=0.3)
