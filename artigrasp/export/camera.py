"""Cameras that look at a set of points from a flattering side, and the daylight that goes with each."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.ndimage import gaussian_filter1d

from artigrasp.arrays import Array
from artigrasp.errors import unknown

Direction = tuple[float, float]
"""From what is looked at to the camera: azimuth about the vertical from x, elevation above the horizon [rad]."""

CameraName = Literal["three-quarter", "front", "side", "top", "orbit", "follow"]
CAMERAS: tuple[CameraName, ...] = get_args(CameraName)
TURNS: dict[CameraName, Direction] = {
    "three-quarter": (50.0, 28.0),
    "front": (0.0, 12.0),
    "side": (90.0, 12.0),
    "top": (0.0, 89.0),
    "orbit": (50.0, 28.0),
    "follow": (50.0, 28.0),
}
"""Azimuth from the direction in which the hands are, and elevation, of each camera, of orbit at the start [deg]."""
FOLLOWING_TIME = 0.4
"""How slowly the camera that follows does so: standard deviation of the mean over time that it takes [s]."""
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


def look_at(points: Array, direction: Direction, aspect: float) -> View:
    """Look at points from a direction, from as near as shows them all.

    Args:
        points: What must be seen, world [m], shape ``[N, 3]``.
        direction: Where the camera is.
        aspect: Width of the image over its height.
    """
    axes = _axes(direction)
    # Centred where the points are seen, then so far away that each of them is within the four borders.
    centres = [axis * (np.min(points @ axis) + np.max(points @ axis)) / 2 for axis in axes]
    middle: Array = np.sum(centres, axis=0)
    return _view(direction, middle, _distance(points - middle, direction, aspect), aspect, direction[0])


def film(name: CameraName, points: Array, time: Array, front: Array, aspect: float) -> list[View]:
    """A view for each of T samples of something that moves.

    Args:
        name: The camera: ``orbit`` goes round once, ``follow`` keeps what moves in the middle, the others stand still.
        points: What must be seen, world [m], shape ``[T, N, 3]``.
        time: Of the samples [s], shape ``[T]``.
        front: Direction towards their front, world, shape ``[3]``; where it is vertical -y counts as the front.
        aspect: Width of the image over its height.

    Raises:
        UserError: there is no such camera.
    """
    if name not in TURNS:
        raise unknown("camera", name, CAMERAS)
    azimuth, elevation = np.radians(TURNS[name])
    azimuth += np.arctan2(front[1], front[0]) if np.hypot(front[0], front[1]) > 1e-3 else -np.pi / 2
    if name not in ("orbit", "follow"):
        return [look_at(points.reshape(-1, 3), (azimuth, elevation), aspect)] * len(points)
    low, high = points.min(axis=1), points.max(axis=1)
    middles = np.tile((low.min(axis=0) + high.max(axis=0)) / 2, (len(points), 1))
    turns = np.zeros(len(points))
    if name == "orbit":
        turns = 2 * np.pi * (time - time[0]) / max(time[-1] - time[0], 1e-9)
    elif len(time) > 1:
        middles = gaussian_filter1d((low + high) / 2, FOLLOWING_TIME / np.median(np.diff(time)), axis=0, mode="nearest")
    directions = [(float(azimuth + turn), float(elevation)) for turn in turns]
    # One distance for all, so that nothing grows or shrinks.
    distance = max(
        _distance(seen - middle, direction, aspect)
        for seen, middle, direction in zip(points, middles, directions, strict=True)
    )
    # The light stays where it is while the camera goes round.
    return [
        _view(direction, middle, distance, aspect, directions[0][0])
        for middle, direction in zip(middles, directions, strict=True)
    ]


def unit_vector(direction: Direction) -> Array:
    """The direction as a vector."""
    azimuth, elevation = direction
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def _axes(direction: Direction) -> tuple[Array, Array, Array]:
    """Unit vectors to the right and upwards in the image, and to the camera."""
    right, back = np.array([-np.sin(direction[0]), np.cos(direction[0]), 0.0]), unit_vector(direction)
    return right, np.cross(back, right), back


def _distance(offsets: Array, direction: Direction, aspect: float) -> float:
    """How far the camera must be from the middle of the image to see points at offsets from it."""
    right, up, back = _axes(direction)
    tangent = np.tan(HALF_ANGLE)
    reach = np.maximum(np.abs(offsets @ right) / (tangent * aspect), np.abs(offsets @ up) / tangent)
    return float(MARGIN * np.max(reach + offsets @ back))


def _view(direction: Direction, middle: Array, distance: float, aspect: float, sun_from: float) -> View:
    right, up, back = _axes(direction)
    tangent = np.tan(HALF_ANGLE)
    return View(
        position=middle + distance * back,
        forward=-back,
        right=tangent * aspect * right,
        up=tangent * up,
        sun=unit_vector((sun_from + SUN_TURN, SUN_ELEVATION)),
    )
