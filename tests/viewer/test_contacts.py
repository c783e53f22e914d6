"""Tests of where contacts are drawn."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from viser import SceneApi

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import BASE, LINK_COUNT, LINKS, PARTS
from artigrasp.viewer.appearance import FORCE_COLOURS, FORCE_STEPS, STRONG, force_colours, force_step
from artigrasp.viewer.contact_sites import ContactSites
from artigrasp.viewer.conventions import to_xyzw
from artigrasp.viewer.force_arrows import LENGTH, NOWHERE, ForceArrows
from artigrasp.viewer.server import Server


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
    """The scale goes from its first to its last colour in equal steps and stays there."""
    colours = force_colours()
    assert len(colours) == FORCE_STEPS
    np.testing.assert_array_equal(colours[[0, -1]], FORCE_COLOURS[[0, -1]])
    assert [force_step(force) for force in (0.0, 0.99 * STRONG, STRONG, 5 * STRONG)] == [0, *[FORCE_STEPS - 1] * 3]
    assert force_step(1.01 * STRONG / FORCE_STEPS) == 1


@pytest.fixture
def scene() -> Iterator[SceneApi]:
    """A scene that nobody watches."""
    server = Server(port=0)
    yield server.viser.scene
    server.stop()


def drawn(scene: SceneApi, force: Array) -> tuple[Array, int]:
    """Tail and tip of the only arrow that is drawn for a force at a point, shape ``[2, 3]``, and its colour."""
    arrows = ForceArrows(scene, "/test")
    point = np.array([0.1, 0.2, 0.3])
    arrows.show([point, point], [np.array([0.0, 0.0, 1.0]), force])
    arrows.show([point], [force])
    handles = [scene.get_handle_by_name(f"/test/forces{step}") for step in range(FORCE_STEPS)]
    shown = [
        (step, bone) for step, handle in enumerate(handles) for bone in handle.bones if bone.position[2] > NOWHERE[2]
    ]
    assert len(shown) == 2
    (step, tail), (_, head) = shown
    np.testing.assert_array_equal(tail.wxyz, head.wxyz)
    along = Rotation.from_quat(to_xyzw(head.wxyz)).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(along, force / np.linalg.norm(force), atol=1e-9)
    return np.stack([tail.position, head.position]), step


@pytest.mark.parametrize("direction", [[0, 0, 1.0], [0, 0, -1.0], [0.6, 0, -0.8], [-0.48, 0.64, 0.6]])
def test_arrow_is_the_force(scene: SceneApi, direction: list[float]) -> None:
    """An arrow begins at the contact, points along the force, is as long as that is large, and has its colour."""
    for size in (3.0, 8.0):
        ends, step = drawn(scene, size * np.array(direction))
        np.testing.assert_allclose(ends[0], [0.1, 0.2, 0.3])
        np.testing.assert_allclose(ends[1] - ends[0], LENGTH * size * np.array(direction), atol=1e-9)
        assert step == force_step(size)


def test_many_forces_of_one_size(scene: SceneApi) -> None:
    """All links of both hands may press alike on both parts: what has no room in its colour takes the next."""
    arrows = ForceArrows(scene, "/test")
    count = 2 * LINK_COUNT * len(PARTS)
    points = list(np.random.default_rng(0).normal(size=(count, 3)))
    arrows.show(points, [np.array([0.0, 0.0, 20.0])] * count)
    tails = [
        bone.position
        for step in range(FORCE_STEPS)
        for bone in scene.get_handle_by_name(f"/test/forces{step}").bones[::2]
        if bone.position[2] > NOWHERE[2]
    ]
    np.testing.assert_allclose(np.sort(np.array(tails), axis=0), np.sort(np.array(points), axis=0))
