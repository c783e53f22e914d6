"""What the other hand does in the mirror, on objects that are their own mirror images, and on no others."""

from dataclasses import replace

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import BASE
from artigrasp.references.quality import measure_contacts
from artigrasp.references.reference import load_references
from artigrasp.references.synthesis.grip import GRIPS, rest
from artigrasp.references.synthesis.mirror import find_mirror_plane, mirror_references

BOX = load_object("lidded-box")
HANDS = (load_hand("open", "left"), load_hand("open", "right"))


def test_the_box_is_its_own_mirror_image() -> None:
    """Across x = 0; not if a corner is cut off, if it is heavier on one side, or if it lies on its side."""
    plane = find_mirror_plane(rest(BOX))
    assert plane is not None and abs(plane.offset) < 1e-6
    np.testing.assert_allclose(np.abs(plane.normal), [1, 0, 0], atol=1e-9)
    vertices = BOX.parts[BASE].vertices.copy()
    vertices[vertices[:, 0].argmax()] -= [0.01, 0, 0]
    cut = replace(BOX, parts=(replace(BOX.parts[BASE], vertices=vertices), BOX.parts[1]))
    off_centre = BOX.parts[BASE].com + np.array([0.01, 0, 0])
    heavy = replace(BOX, parts=(replace(BOX.parts[BASE], com=off_centre), BOX.parts[1]))
    assert find_mirror_plane(rest(cut)) is None and find_mirror_plane(rest(heavy)) is None
    on_its_side = np.array([0, 0, 0, 0, np.sqrt(0.5), 0, np.sqrt(0.5)])
    assert find_mirror_plane(rest(BOX, on_its_side)) is None


def test_left_hands_touch_as_right_ones_did() -> None:
    """As deep, with as many contacts; mirrored twice they are what they were."""
    plane = find_mirror_plane(rest(BOX))
    assert plane is not None
    right = load_references("lidded-box").select(kind="articulate", indices=range(4))
    left = mirror_references(right, plane)
    assert left.active.tolist() == [[True, False]] * 4
    before, after = (measure_contacts(each, BOX, HANDS) for each in (right, left))
    np.testing.assert_allclose(after.deepest, before.deepest, atol=1e-4)
    np.testing.assert_array_equal(after.missing_contacts, before.missing_contacts)
    again = mirror_references(left, plane)
    np.testing.assert_allclose(again.finger_angles, right.finger_angles, atol=1e-6)
    np.testing.assert_allclose(
        np.abs((again.wrist_pose_in_part[..., 3:] * right.wrist_pose_in_part[..., 3:]).sum(-1)), 1, atol=1e-5
    )
    np.testing.assert_allclose(again.wrist_pose_in_part[..., :3], right.wrist_pose_in_part[..., :3], atol=1e-6)


def test_grips_know_their_mirror_images() -> None:
    """Left and right change places; both hands remain both hands."""
    assert GRIPS["articulate-right"].mirrored == "articulate-left"
    assert GRIPS["grasp-left"].mirrored == "grasp-right" and GRIPS["grasp-both"].mirrored == "grasp-both"
