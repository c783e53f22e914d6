"""Signals of a made-up motion against what its vertices do."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.object import load_object
from artigrasp.config import ExtractionConfig
from artigrasp.references.interactions import FRAME_RATE
from artigrasp.references.signals import measure_signals

BOX = load_object("lidded-box")
FRAME_COUNT = 60
UNSMOOTHED = ExtractionConfig(smoothing=0.0)


def tumbling() -> np.ndarray:
    """States of a box that rests for 20 frames, then rises, turns about a skew axis and opens, shape (T, 7)."""
    time = np.clip(np.arange(FRAME_COUNT) - 20, 0, None) / FRAME_RATE
    states = np.zeros((FRAME_COUNT, 7))
    states[:, 0] = 0.8 * time
    states[:, 1:4] = time[:, None] * [0.6, -0.9, 0.4]
    states[:, 4:] = 1000 * (np.array([0.1, 0.2, 1.0]) + time[:, None] * [0.1, 0.0, 0.3])
    return states


def vertices_in_world(state: np.ndarray) -> np.ndarray:
    """Vertices of both parts, one pose at a time [m]."""
    return Rotation.from_rotvec(state[1:4]).apply(BOX.vertices_in_base(state[0])) + state[4:] / 1000


def test_speed_and_height_are_those_of_the_vertices() -> None:
    """The speed is the root mean square over the base, the height that of the lowest vertex of both parts."""
    states = tumbling()
    signals = measure_signals(BOX, states, np.zeros((FRAME_COUNT, 2, 3, 16), bool), UNSMOOTHED)
    worlds = np.array([vertices_in_world(state) for state in states])
    base = worlds[:, : len(BOX.parts[0].vertices)]
    velocity = np.gradient(base, axis=0) * FRAME_RATE
    speed = np.sqrt((velocity**2).sum(axis=-1).mean(axis=-1))
    np.testing.assert_allclose(signals.base_speed[22:-1], speed[22:-1], rtol=0.02)
    assert signals.base_speed[:19].max() < 1e-9
    lowest = worlds[..., 2].min(axis=1)
    np.testing.assert_allclose(signals.height, lowest - lowest[0], atol=1e-9)
    np.testing.assert_allclose(signals.hinge_rate[22:-1], 0.8, rtol=1e-6)


def test_the_surface_is_where_an_untouched_object_lies() -> None:
    """A hand that holds the object still in the air does not make a surface there."""
    states = np.tile(tumbling()[:1], (FRAME_COUNT, 1))
    states[15:, 6] += 200.0
    contacts = np.zeros((FRAME_COUNT, 2, 3, 16), bool)
    contacts[10:, 0, 1:, :5] = True
    signals = measure_signals(BOX, states, contacts, ExtractionConfig())
    np.testing.assert_allclose(signals.height[[0, -1]], [0.0, 0.2], atol=1e-9)
    assert signals.holding_links[-1].tolist() == [5, 0] and signals.turning_links.max() == 0


@pytest.mark.parametrize("smoothing", [0.0, 0.05, 0.2])
def test_smoothing_takes_noise_away(smoothing: float) -> None:
    """Noise of a millimetre would seem a movement at 30 frames per second, if it were not smoothed."""
    states = np.tile(tumbling()[:1], (FRAME_COUNT, 1))
    states[:, 4:] += np.random.default_rng(0).normal(size=(FRAME_COUNT, 3))
    config = ExtractionConfig(smoothing=smoothing)
    signals = measure_signals(BOX, states, np.zeros((FRAME_COUNT, 2, 3, 16), bool), config)
    assert (signals.base_speed.max() > 0.05) == (smoothing == 0.0)
