"""Tests of cameras: everything is seen, from where it should be."""

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.export.camera import CAMERAS, View, film, look_at, unit_vector

FRONT = np.array([0.0, -1.0, 0.2])


def moving_points(count: int = 12) -> np.ndarray:
    """A flat cloud that moves along x for a second, shape [T, N, 3]."""
    cloud = np.random.default_rng(0).normal(size=(200, 3)) * [0.1, 0.3, 0.2] + [1, -2, 0.5]
    return cloud + np.linspace(0, 1, count)[:, None, None] * [0.5, 0, 0]


def in_image(view: View, points: np.ndarray) -> np.ndarray:
    """Where points are seen: 1 is at the right and the upper border, shape [2, N]."""
    offset = points - view.position
    depth = offset @ view.forward
    assert (depth > 0).all()
    return np.stack([offset @ axis / (axis @ axis) / depth for axis in (view.right, view.up)])


@pytest.mark.parametrize("aspect", [0.7, 1.0, 2.5])
def test_view_holds_all_points(aspect: float) -> None:
    """All points are within the image, and it is no larger than it must be."""
    points = moving_points()[0]
    view = look_at(points, (-0.7, 0.5), aspect)
    assert 0.85 < np.abs(in_image(view, points)).max() <= 1
    np.testing.assert_allclose(view.forward, -unit_vector((-0.7, 0.5)), atol=1e-12)
    assert np.linalg.norm(view.right) / np.linalg.norm(view.up) == pytest.approx(aspect)


@pytest.mark.parametrize("name", CAMERAS)
def test_every_camera_holds_what_moves(name: str) -> None:
    """At every sample all points of it are within the image, and somewhere near its border."""
    points = moving_points()
    views = film(name, points, np.linspace(0, 1, len(points)), FRONT, 1.5)
    reach = [np.abs(in_image(view, seen)).max() for view, seen in zip(views, points, strict=True)]
    assert max(reach) <= 1 and max(reach) > 0.8


def test_cameras_are_where_their_names_say() -> None:
    """Front, side and top look from there; orbit goes round once; follow moves along; all others stand still."""
    points, time = moving_points(13), np.linspace(0, 1, 13)
    views = {name: film(name, points, time, FRONT, 1.0) for name in CAMERAS}
    back = {name: -np.array([view.forward for view in views[name]]) for name in CAMERAS}
    assert back["front"][0, 1] < -0.9
    assert abs(back["side"][0, 0]) > 0.9
    assert back["top"][0, 2] > 0.99
    for name in set(CAMERAS) - {"orbit", "follow"}:
        assert (back[name] == back[name][0]).all() and all(view is views[name][0] for view in views[name])
    turned = np.unwrap(np.arctan2(back["orbit"][:, 1], back["orbit"][:, 0]))
    np.testing.assert_allclose(np.diff(turned), 2 * np.pi / 12, atol=1e-9)
    moved = views["follow"][-1].position - views["follow"][0].position
    assert moved[0] > 0.2 and np.abs(moved[1:]).max() < 1e-9


def test_one_sample_and_a_front_from_above() -> None:
    """A picture of one sample works with every camera, also with the hands right above the object."""
    for name in CAMERAS:
        (view,) = film(name, moving_points(1), np.zeros(1), np.array([0.0, 0.0, 1.0]), 1.0)
        assert np.isfinite([view.position, view.forward, view.right, view.up, view.sun]).all()


def test_unknown_camera_is_named() -> None:
    """A camera that there is not is the user's mistake."""
    with pytest.raises(UserError, match="unknown camera 'frnt': did you mean 'front'"):
        film("frnt", moving_points(1), np.zeros(1), FRONT, 1.0)  # type: ignore[arg-type]
