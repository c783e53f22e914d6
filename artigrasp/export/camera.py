"""A camera that looks at a set of points from a flattering side, and the daylight that goes with it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ELEVATION = np.radians(28.0)
"""Height of the camera above the horizon, seen from what it looks at [rad]."""
TURN = np.radians(50.0)
"""From the direction in which the hands are to that of the camera, about the vertical [rad]."""
SUN_TURN, SUN_ELEVATION = np.radians(-75.0), np.radians(50.0)
"""Direction of the key light: about the vertical from the camera's, and above the horizon [rad]."""
HALF_ANGLE = np.radians(12.0)
"""Half the angle that the image covers from top to bottom [rad]: small, so that little is distorted."""
MARGIN = 1.08
"""Distance of the camera over that at which the outermost points touch the border."""


@dataclass(frozen=True, eq=False)
class View:
    """A camera and its light, all vectors in the world.

    Attributes:
        position: Of the camera [m], shape ``[3]``.
        forward: Unit vector along the line of sight.
        right: From the middle of the image to its right border at unit distance.
        up: From the middle of the image to its upper border at unit distance.
        sun: Unit vector towards the key light.
    """

    position: Array
    forward: Array
    right: Array
    up: Array
    sun: Array


def three_quarter_view(points: Array, front: Array, aspect: float) -> View:
    """Look at points from above and from beside the direction that is their front.

    Args:
        points: What must be seen, world [m], shape ``[N, 3]``.
        front: Direction towards their front, world, shape ``[3]``; where it is vertical -y counts as the front.
        aspect: Width of the image over its height.
    """
    azimuth = np.arctan2(front[1], front[0]) if np.hypot(front[0], front[1]) > 1e-3 else -np.pi / 2
    back = _direction(azimuth + TURN, ELEVATION)
    right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
    up = np.cross(back, right)
    tangent = np.tan(HALF_ANGLE)
    # Centred where the points are seen, then so far away that each of them is within the four borders.
    middle = sum(axis * (np.min(points @ axis) + np.max(points @ axis)) / 2 for axis in (right, up, back))
    offset = points - middle
    reach = np.maximum(np.abs(offset @ right) / (tangent * aspect), np.abs(offset @ up) / tangent)
    distance = MARGIN * np.max(reach + offset @ back)
    return View(
        position=middle + distance * back,
        forward=-back,
        right=tangent * aspect * right,
        up=tangent * up,
        sun=_direction(azimuth + TURN + SUN_TURN, SUN_ELEVATION),
    )


def _direction(azimuth: float, elevation: float) -> Array:
    horizontal = np.cos(elevation)
    return np.array([horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), np.sin(elevation)])
