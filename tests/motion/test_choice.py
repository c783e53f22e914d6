"""Tests of what a motion is generated from."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.motion.choice import choose_references, target_offset
from artigrasp.references.reference import load_references


@pytest.mark.parametrize(
    ("sequence", "kinds"),
    [
        (None, ["articulate"]),
        ("grasp-then-articulate", ["grasp", "articulate"]),
        ("articulate-then-grasp", ["articulate", "grasp"]),
    ],
)
def test_references_are_played_in_the_order_of_the_sequence(sequence: str | None, kinds: list[str]) -> None:
    """One reference plays alone; of a sequence the name says which is first."""
    every = load_references("lidded-box")
    chosen = choose_references(every, sequence, split="test", articulation=2, grasp=1)
    index = {"articulate": 2, "grasp": 1}
    expected = [every.select(split="test", kind=kind, indices=index[kind]).source[0] for kind in kinds]
    assert chosen.kind.tolist() == kinds
    assert chosen.source.tolist() == expected


def test_target_is_shifted_and_turned_about_the_vertical() -> None:
    """A quarter turn takes x to y."""
    offset = target_offset((0.1, 0.2, 0.3), np.pi / 2)
    assert offset[:3] == (0.1, 0.2, 0.3)
    np.testing.assert_allclose(Rotation.from_quat(offset[3:]).apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-12)
