"""Where fingers may go, and hands that begin there, on a box whose faces are known."""

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import ARTICULATED, BASE
from artigrasp.references.natural_pose import mirror_fingers, recorded_natural_pose, relaxed_pose
from artigrasp.references.synthesis.fingertips import Fingertips, start_poses, tip_centres
from artigrasp.references.synthesis.grip import GRIPS, rest
from artigrasp.references.synthesis.intents import THUMB, WIDEST, draw_intents
from artigrasp.references.synthesis.surface import sample_surface

RESTING = rest(load_object("lidded-box"))
SURFACE = sample_surface(RESTING, 3000, seed=0)


def test_the_box_stands_on_the_table() -> None:
    """Upright as in its file, with its centre of mass inside and its lever from the hinge to the lip."""
    np.testing.assert_allclose(RESTING.pose, [0, 0, 0, 0, 0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(RESTING.lever, 0.2, atol=0.02)
    assert 0.03 < RESTING.com[2] < 0.1
    tilted = rest(load_object("lidded-box"), np.array([0.3, 0, 9.0, np.sqrt(0.5), 0, 0, np.sqrt(0.5)]))
    np.testing.assert_allclose(tilted.up, [0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(tilted.pose[:3], [0.3, 0, 0.11], atol=1e-6)


def test_fingers_come_to_the_outside_only() -> None:
    """Nothing inside the closed box or below it is for fingers."""
    x, y, z = SURFACE.position.T
    inside = (np.abs(x) < 0.11) & (np.abs(y) < 0.08) & (z > 0.01) & (z < 0.13)
    assert not inside.any()
    assert not ((SURFACE.normal[:, 2] < -0.9) & (z < 0.05)).any()
    assert {BASE, ARTICULATED} == set(SURFACE.part.tolist())


def test_the_lid_opens_best_below_its_lip() -> None:
    """Far from the hinge, pushed up; not at all from above, and not by the base."""
    best = SURFACE.opening.argmax()
    assert SURFACE.position[best, 1] < -0.09 and SURFACE.normal[best, 2] < -0.9
    above = (SURFACE.normal[:, 2] > 0.9) & (SURFACE.part == ARTICULATED)
    assert SURFACE.opening[above].max() < 0.05 and (SURFACE.opening[SURFACE.part == BASE] == 0).all()


def test_thumbs_press_against_fingers() -> None:
    """To open, both are on the lid, and no farther apart than a hand can reach."""
    intents = draw_intents(GRIPS["articulate-right"], RESTING, SURFACE, 60, 0)
    assert intents is not None
    assert (intents.part[intents.busy] == ARTICULATED).all()
    apart = np.linalg.norm(intents.target[:, 0, THUMB] - intents.target[:, 0, 2], axis=1)
    with_thumb = intents.busy[:, 0, THUMB]
    assert with_thumb.any() and (apart[with_thumb] <= WIDEST + 1e-9).all()
    again = draw_intents(GRIPS["articulate-right"], RESTING, SURFACE, 60, 0)
    np.testing.assert_array_equal(again.target, intents.target)


def test_two_hands_take_opposite_sides() -> None:
    """The right one is on the right of somebody whose forearms come from one side; one hand is too small."""
    intents = draw_intents(GRIPS["grasp-both"], RESTING, SURFACE, 20, 0)
    assert intents is not None
    normals = intents.normal[:, :, 2]
    assert ((normals[:, 0] * normals[:, 1]).sum(axis=1) < -0.6).all()
    assert draw_intents(GRIPS["grasp-right"], RESTING, SURFACE, 20, 0) is None


def test_hands_begin_at_what_they_are_meant_for() -> None:
    """The busy long fingertips are in front of their points on average; left hands are right ones mirrored."""
    intents = draw_intents(GRIPS["articulate-right"], RESTING, SURFACE, 10, 0)
    assert intents is not None
    poses = {side: start_poses(intents, [load_hand("open", side)], relaxed_pose(), 0) for side in ("left", "right")}
    hand = load_hand("open", "right")
    tips = Fingertips([hand])
    long = intents.busy & (np.arange(5) != THUMB)
    offset = (
        tip_centres(*poses["right"], [hand], tips) - intents.target - intents.normal * (tips.radius + 0.01)[..., None]
    )
    mean = (offset * long[..., None]).sum(axis=2) / long.sum(axis=2)[..., None]
    np.testing.assert_allclose(mean, 0, atol=1e-5)
    np.testing.assert_allclose(poses["left"][1], mirror_fingers(poses["right"][1]))


def test_nothing_recorded_leaves_a_hand_that_bends_as_hands_do() -> None:
    """Bending all joints of a finger is natural, turning one of them the other way is not."""
    natural = recorded_natural_pose("open")
    assert natural.count == 0

    def cost(change: dict[int, float]) -> float:
        pose = natural.mean.copy()
        for index, angle in change.items():
            pose[index] += angle
        return float(np.sum((natural.whitening @ (pose - natural.mean)) ** 2))

    assert cost({2: 0.3, 5: 0.3, 8: 0.2}) < 5 < cost({3: 0.3}) and cost({5: -0.3, 8: 0.3}) > 20
