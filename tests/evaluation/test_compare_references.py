"""Synthesised references beside recorded ones."""

import json

import numpy as np

from artigrasp.references.reference import load_references
from artigrasp.references.synthesis.grip import GRIPS
from tools.compare_references import depths_and_contacts, fitted, of_grip


def test_references_of_a_kind_are_spread_over_all_that_there_are() -> None:
    """Only those in which just its hands take part; what synthesis says of itself is told, and nothing of others."""
    references = load_references("open-box")
    for grip in GRIPS.values():
        chosen, count = of_grip(references, grip, 3)
        assert len(chosen) == min(3, count) and set(chosen.kind.tolist()) <= {grip.kind}
        assert (chosen.active == ["left" in grip.sides, "right" in grip.sides]).all()
    right, count = of_grip(references, GRIPS["articulate-right"], 3)
    of_kind = references.select(kind="articulate", hands=("right",)).source
    assert count == len(of_kind) and (right.source[0], right.source[-1]) == (of_kind[0], of_kind[-1])
    assert fitted(right, GRIPS["articulate-right"]) == ", 22 sound of 32"
    assert fitted(load_references("lidded-box"), GRIPS["articulate-right"]) == ""


def test_depths_and_contacts_are_those_that_synthesis_found() -> None:
    """What its files say of every reference."""
    references = load_references("open-box").select(indices=np.arange(4))
    grips = json.loads(references.provenance)["grips"].values()
    records = {each["source"]: each for grip in grips for each in grip["references"]}
    depth, touching = depths_and_contacts(references)
    np.testing.assert_allclose(depth, [records[each]["deepest"] for each in references.source], atol=1e-5)
    assert (touching >= [records[each]["contacts"] for each in references.source]).all(), (
        "of these some are on the base"
    )
