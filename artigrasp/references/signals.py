"""What the rules of extraction look at, measured in a recording: motion of the object, and contacts."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.object import ObjectModel
from artigrasp.config.extraction import ExtractionConfig
from artigrasp.kernels.layout import ARTICULATED, BASE
from artigrasp.references.arctic_references import CONTACT_WITH_ARTICULATED, CONTACT_WITH_EITHER, base_pose
from artigrasp.references.interactions import FRAME_RATE, Signals

AT_REST = 0.02
"""A base slower than this lies still: its lowest point then tells where the surface is [m/s]."""


def measure_signals(
    model: ObjectModel, states: Array, contacts: NDArray[np.bool_], config: ExtractionConfig
) -> Signals:
    """Measure a recording of T frames.

    Args:
        model: The object.
        states: Its states in the world as a sequence has them, shape (T, 7).
        contacts: Contacts of the hands with it as a sequence has them, shape (T, 2, 3, 16).
        config: Says how to smooth.
    """
    links = contacts.sum(axis=-1)
    touched = links[..., CONTACT_WITH_EITHER].any(axis=-1)
    speed = _base_speed(model, states, config)
    lowest = _lowest_points(model, states)
    untouched = ~touched & (speed < AT_REST)
    angle = _smooth(states[:, 0], config)
    return Signals(
        base_speed=speed,
        hinge_angle=angle,
        hinge_rate=_rate(angle),
        height=lowest - (np.median(lowest[untouched]) if untouched.any() else lowest.min()),
        turning_links=links[..., CONTACT_WITH_ARTICULATED],
        holding_links=links[..., CONTACT_WITH_EITHER],
    )


def _base_speed(model: ObjectModel, states: Array, config: ExtractionConfig) -> Array:
    """Root mean square speed of the base's vertices [m/s], shape (T,)."""
    vertices = model.parts[BASE].vertices
    centre = vertices.mean(axis=0)
    velocity = _rate(_smooth(base_pose(states).apply(centre), config))
    rotation = Rotation.from_rotvec(states[:, 1:4])
    turns = (rotation[:-1].inv() * rotation[1:]).as_rotvec() * FRAME_RATE
    turning = _smooth(np.concatenate([turns, turns[-1:]]), config)
    # Of points r about their centre, turning at w, the mean of |w x r|² is w·(mean |r|² - r rᵀ)·w.
    covariance = np.cov((vertices - centre).T, bias=True)
    spread = np.trace(covariance) * np.eye(3) - covariance
    speed: Array = np.sqrt((velocity**2).sum(axis=-1) + np.einsum("ti,ij,tj->t", turning, spread, turning))
    return speed


def _lowest_points(model: ObjectModel, states: Array) -> Array:
    """Height of the lowest vertex of the object in the world [m], shape (T,)."""
    base = base_pose(states)
    turn = Rotation.from_rotvec(states[:, :1] * model.hinge_axis)
    articulated = base.rotation * turn
    origin = base.apply(model.hinge_origin) - articulated.apply(model.hinge_origin)
    heights = []
    for part, rotation, position in ((BASE, base.rotation, base.translation), (ARTICULATED, articulated, origin)):
        up_in_part = rotation.inv().apply([0.0, 0.0, 1.0])
        heights.append((up_in_part @ model.parts[part].vertices.T).min(axis=1) + position[:, 2])
    lowest: Array = np.minimum(*heights)
    return lowest


def _smooth(values: Array, config: ExtractionConfig) -> Array:
    frames = config.smoothing * FRAME_RATE
    smoothed: Array = gaussian_filter1d(values, frames, axis=0, mode="nearest") if frames > 0 else values
    return smoothed


def _rate(values: Array) -> Array:
    rate: Array = np.gradient(values, axis=0) * FRAME_RATE
    return rate
