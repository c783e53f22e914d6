"""Which idle hands hold the box still in their references."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import BASE
from artigrasp.references.steadying import steadying_hands
from tests.example_references import box_references

LEFT, RIGHT = 0, 1


@pytest.mark.parametrize(
    ("position", "active", "expected"),
    [
        ((0.0, 0.0, 0.1), False, True),
        ((0.0, 0.0, 0.1), True, False),
        ((0.5, 0.0, 0.1), False, False),
        ((0.0, 0.0, -0.04), False, False),
    ],
    ids=["in the box", "taking part", "beside it", "under the table"],
)
def test_a_hand_steadies_what_it_touches(position: tuple[float, float, float], active: bool, expected: bool) -> None:
    """If it has no other task, touches the base, and is not under the table."""
    references = box_references()
    wrists, taking_part = references.wrist_pose_in_part.copy(), references.active.copy()
    wrists[:, LEFT] = [*position, 0.0, 0.0, 0.0, 1.0]
    taking_part[:, LEFT] = active
    references = replace(references, wrist_pose_in_part=wrists, active=taking_part)
    assert references.part[:, LEFT].tolist() == [BASE] * 3
    found = steadying_hands(references, load_object("lidded-box"))
    np.testing.assert_array_equal(found, np.tile([expected, False], (3, 1)))


def test_height_is_counted_in_the_world() -> None:
    """An object that stands higher has room beneath it."""
    references = box_references()
    wrists, objects = references.wrist_pose_in_part.copy(), references.object_pose.copy()
    wrists[:, LEFT] = [0.0, 0.0, -0.04, 0.0, 0.0, 0.0, 1.0]
    objects[1, 2] = 0.2
    references = replace(references, wrist_pose_in_part=wrists, object_pose=objects)
    assert steadying_hands(references, load_object("lidded-box"))[:, LEFT].tolist() == [False, True, False]
