"""Tests of where contacts are drawn."""

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import BASE, LINKS
from artigrasp.viewer.appearance import FORCE_COLOURS, STRONG, force_colours
from artigrasp.viewer.contact_figure import ContactSites


def test_site_is_where_a_finger_touches() -> None:
    """A fingertip over the middle of a wall touches it right there, whatever frame the poses are in."""
    hand, object = load_hand("open", "right"), load_object("lidded-box")
    link = LINKS.index("index3")
    low, high = object.parts[BASE].vertices.min(axis=0), object.parts[BASE].vertices.max(axis=0)
    middle = (low + high) / 2
    outside = np.array([high[0] + 0.05, middle[1], middle[2], 0, 0, 0, 1])
    at_origin = np.array([0, 0, 0, 0, 0, 0, 1.0])
    site = ContactSites([hand], object).nearest(0, link, BASE, outside, at_origin)
    assert abs(site[0] - high[0]) < 1e-3
    assert np.linalg.norm(site[1:] - middle[1:]) < 0.03
    shift = np.array([1.0, 2, 3, 0, 0, 0, 0])
    moved = ContactSites([hand], object).nearest(0, link, BASE, outside + shift, at_origin + shift)
    np.testing.assert_allclose(moved, site)


def test_colours_of_forces() -> None:
    """The scale goes from its first to its last colour and stays there."""
    colours = force_colours([0.0, STRONG, 5 * STRONG])
    np.testing.assert_array_equal(colours, FORCE_COLOURS[[0, -1, -1]])
