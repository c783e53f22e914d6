"""Points that stand for the surface of a hand, against the exact distance from its colliders."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import Capsule, HandModel, load_hand
from artigrasp.assets.hand_surface import SAG, core_points
from artigrasp.kernels.layout import LINK_COUNT


def distance_from_colliders(hand: HandModel, link: int, points: np.ndarray) -> np.ndarray:
    """Distance of points [N, 3] of the link's frame from its surface, negative inside, boxes being rounded [N]."""
    distances = []
    for collider in hand.colliders[link]:
        local = Rotation.from_quat(collider.orientation).inv().apply(points - collider.position)
        if isinstance(collider, Capsule):
            core, radius = np.array([0, 0, collider.length / 2]), collider.radius
        else:
            radius = collider.extents.min() / 2
            core = collider.extents / 2 - radius
        distances.append(np.linalg.norm(np.maximum(np.abs(local) - core, 0), axis=1) - radius)
    return np.min(distances, axis=0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_balls_are_the_hand(side: str) -> None:
    """Around every link, the distance from the nearest ball is that from the colliders, to the permitted sag."""
    hand = load_hand("open", side)
    balls = core_points(hand)
    assert (np.diff(balls.link) >= 0).all()
    for link in range(LINK_COUNT):
        of_link = balls.link == link
        centre, radius = balls.position[of_link], balls.radius[of_link]
        middle, spread = centre.mean(axis=0), np.ptp(centre, axis=0).max() + 2 * radius.max()
        points = middle + np.random.default_rng(link).uniform(-spread, spread, (500, 3))
        exact = distance_from_colliders(hand, link, points)
        found = (np.linalg.norm(points[:, None] - centre, axis=-1) - radius).min(axis=1)
        outside = exact > 0
        assert (found >= exact - 1e-9)[outside].all()
        assert (found - exact)[outside].max() < 1.05 * SAG
