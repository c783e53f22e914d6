"""What contacts can do, in cases that need no computer, and which grips count as different."""

import numpy as np

from artigrasp.assets.object import load_object
from artigrasp.references.synthesis.grip import rest
from artigrasp.references.synthesis.selection import LEAST_DIFFERENCE, Descriptors, choose_different
from artigrasp.references.synthesis.surface import FRICTION
from artigrasp.references.synthesis.wrench import holding_error, opening_torque

RESTING = rest(load_object("lidded-box"))
X, Y, Z = np.eye(3)


def test_two_sides_hold_and_one_does_not() -> None:
    """Four contacts on two opposite sides about the centre of mass hold the weight by friction."""
    sides = np.array([RESTING.com + x * X + y * Y for x in (-0.12, 0.12) for y in (-0.03, 0.03)])
    normals = np.array([-X, -X, X, X])
    assert holding_error(sides, normals, RESTING) < 1e-6
    assert holding_error(sides[:2], normals[:2], RESTING) > 0.5
    assert holding_error(sides[:0], normals[:0], RESTING) == 1.0
    from_above = RESTING.com + 0.08 * Z
    assert holding_error(from_above[None], Z[None], RESTING) > 0.9


def test_torque_of_a_finger_below_the_lip() -> None:
    """Pushing up where the lever ends turns the hinge by all its force, pushing down not at all, and the side a bit."""
    lip = RESTING.model.hinge_origin - RESTING.lever * Y
    assert np.isclose(opening_torque(lip[None], -Z[None], RESTING), 1.0)
    assert opening_torque(lip[None], Z[None], RESTING) < 0
    assert np.isclose(opening_torque(lip[None], -Y[None], RESTING), FRICTION)
    assert np.isclose(opening_torque(lip[None] + 0.5 * RESTING.lever * Y, -Z[None], RESTING), 0.5)
    assert opening_torque(lip[:0].reshape(0, 3), lip[:0].reshape(0, 3), RESTING) == 0


def test_the_same_grip_is_chosen_once() -> None:
    """The cheapest comes first, then what differs; what costs too much or is unfit is left out."""
    wrist = np.zeros((5, 1, 7))
    wrist[..., 6] = 1.0
    wrist[:, 0, 0] = [0.0, 0.001, 0.2, 0.4, 0.8]
    grips = Descriptors(wrist, np.ones((5, 1, 16), bool))
    cost, eligible = np.array([2.0, 1.0, 1.5, 1.0, 1.0]), np.array([True, True, True, True, False])
    assert choose_different(grips, cost, eligible, 10).tolist() == [1, 3, 2]
    assert choose_different(grips, cost, eligible, 2).tolist() == [1, 3]
    assert len(choose_different(grips, cost, np.zeros(5, bool), 3)) == 0
    assert grips.differences(0, np.array([0, 1]))[1] < LEAST_DIFFERENCE


def test_grips_differ_in_place_turn_and_contacts() -> None:
    """Each by itself."""
    wrist = np.zeros((3, 1, 7))
    wrist[..., 6] = 1.0
    wrist[1, 0, 3:] = [np.sin(0.5), 0, 0, np.cos(0.5)]
    contacts = np.ones((3, 1, 16), bool)
    contacts[2, 0, :8] = False
    differences = Descriptors(wrist, contacts).differences(0, np.arange(3))
    np.testing.assert_allclose(differences, [0, 2, 1])
