"""The references that are shipped with the open objects: synthesised, and as sound as the verb says."""

import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.assets.library import packaged_root
from artigrasp.assets.object import load_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, object_name
from artigrasp.references.quality import measure_contacts
from artigrasp.references.reference import read_references

FILES = sorted((packaged_root() / "references").glob("open-*.npz"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_shipped_references_touch_and_harm_nothing(file: Path) -> None:
    """They are shallow, miss no contact, keep to the joint limits, and say what they work with."""
    references = read_references(file)
    hands = (load_hand(references.hand, "left"), load_hand(references.hand, "right"))
    measured = measure_contacts(references, load_object(references.object), hands)
    assert np.median(measured.deepest) < 0.002 and measured.deepest.max() < 0.003
    assert (measured.missing_contacts == 0).all() and (measured.target_contacts >= 2).all()
    assert measured.beyond_limits.max() < 0.05
    assert {"train", "test"} == set(references.split.tolist())
    grips = json.loads(references.provenance)["grips"]
    records = [record for grip in grips.values() for record in grip["references"]]
    assert sorted(record["source"] for record in records) == sorted(references.source.tolist())
    assert {record["verdict"] for record in records} <= {"pd-ik", "search"}


def test_enough_are_shipped_of_every_category() -> None:
    """At least 20 of each but the scissors, of either hand and of both, some of each kind held out."""
    assert {file.stem for file in FILES} == {object_name(each) for each in CATEGORIES}
    for file in FILES:
        if file.stem == "open-scissors":
            continue
        references = read_references(file)
        assert len(references) >= 20
        for kind in ("articulate", "grasp"):
            held_out = (references.kind == kind) & (references.split == "test")
            assert held_out.any()
        for taking in ((False, True), (True, False), (True, True)):
            assert (references.active == taking).all(axis=1).any()
