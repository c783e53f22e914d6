"""Tests of pictures and videos: what must be seen is seen, where it should be, and nothing is cut off."""

import dataclasses
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import pytest
import trimesh

from artigrasp.errors import UserError
from artigrasp.export.camera import View, three_quarter_view
from artigrasp.export.picture import PAPER, caption, render_filmstrip, render_frame, render_video
from artigrasp.export.raycaster import render_surface
from artigrasp.export.surface import mesh_surface
from artigrasp.motion.file import Motion
from tests.motion.example import example_motion

RED = np.array([0.8, 0.05, 0.05])
"""Linear RGB."""


def opening_motion(sample_count: int = 11) -> Motion:
    """The box stands on the floor and opens, a still hand in front of it, for a second."""
    motion = example_motion(sample_count=sample_count)
    return dataclasses.replace(
        motion,
        time=np.linspace(0, 1, sample_count),
        hand_base=[[0, -0.25, 0.15, 0, 0, 0, 1]],
        joint_q=np.zeros_like(motion.joint_q),
        object_pose=np.tile([0.0, 0, 0, 0, 0, 0, 1], (sample_count, 1)),
    )


def paper_like(image: np.ndarray) -> np.ndarray:
    """Where an image shows nothing but lit floor, shape [height, width]."""
    return np.abs(image.astype(int) - PAPER).max(axis=-1) <= 3


def pixel(view: View, point: np.ndarray, width: int, height: int) -> tuple[int, int]:
    """Row and column at which a point is seen."""
    offset = point - view.position
    across, along = (offset @ axis / (axis @ axis) / (offset @ view.forward) for axis in (view.right, view.up))
    return int((1 - along) / 2 * height), int((1 + across) / 2 * width)


@pytest.mark.parametrize("aspect", [0.7, 1.0, 2.5])
def test_view_holds_all_points(aspect: float) -> None:
    """All points are within the image, and it is no larger than it must be."""
    points = np.random.default_rng(0).normal(size=(200, 3)) * [0.1, 0.3, 0.2] + [1, -2, 0.5]
    view = three_quarter_view(points, np.array([0.0, -1, 0]), aspect)
    offset = points - view.position
    depth = offset @ view.forward
    across = [offset @ axis / (axis @ axis) / depth for axis in (view.right, view.up)]
    assert (depth > 0).all()
    assert 0.85 < np.abs(across).max() <= 1
    assert view.position[2] > points[:, 2].mean() and view.position[1] < points[:, 1].mean()


def test_view_of_points_seen_from_above_has_a_front() -> None:
    """Hands right above the object leave the front open; a default is taken."""
    view = three_quarter_view(np.eye(3), np.array([0.0, 0.0, 1.0]), 1.0)
    assert np.isfinite([view.position, view.forward, view.right, view.up, view.sun]).all()


def test_a_lit_body_stands_on_the_floor() -> None:
    """The middle of the image has the body's colour, its borders are plain, and the floor beside it is in shadow."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.apply_translation((0, 0, 0.05))
    surface = mesh_surface(box.vertices, box.faces)
    ground = np.array([[x, y, 0.0] for x in (-0.4, 0.4) for y in (-0.4, 0.4)])
    view = three_quarter_view(np.concatenate([ground, box.vertices]), np.array([0.0, -1, 0]), 1.5)
    image = render_surface(surface, np.broadcast_to(RED, (12, 3)), view, width=90, height=60)
    red, green, blue = image[30, 45].astype(int)
    assert red > 2 * green and red > 2 * blue
    assert paper_like(image)[[0, 0, -1, -1], [0, -1, 0, -1]].all()
    away_from_sun = -0.09 * view.sun[:2] / np.linalg.norm(view.sun[:2])
    shadow, light = (image[pixel(view, np.append(sign * away_from_sun, 0), 90, 60)].astype(int) for sign in (1, -1))
    assert shadow.sum() < light.sum() - 90
    np.testing.assert_array_equal(
        image, render_surface(surface, np.broadcast_to(RED, (12, 3)), view, width=90, height=60)
    )


def test_filmstrip_shows_the_whole_motion(tmp_path: Path) -> None:
    """The strip has its size, every frame shows something, and nothing touches the upper border."""
    render_filmstrip(opening_motion(), tmp_path / "strip.png", frame_count=3, width=360, height=120)
    image = imageio.imread(tmp_path / "strip.png")
    assert image.shape == (120, 360, 3)
    assert paper_like(image[0]).all()
    for frame in np.split(image[:100], 3, axis=1):
        assert 0.05 < (~paper_like(frame)).mean() < 0.8
    assert (image[:100, :120] != image[:100, 240:]).any()


def test_frame_and_video(tmp_path: Path) -> None:
    """A picture and a video have the size, and the video the length, that were asked for."""
    motion = opening_motion()
    render_frame(motion, tmp_path / "frame.png", width=80, height=60)
    assert imageio.imread(tmp_path / "frame.png").shape == (60, 80, 3)
    seen: list[tuple[int, int]] = []
    render_video(
        motion, tmp_path / "motion.mp4", rate=5, width=80, height=60, progress=lambda *counts: seen.append(counts)
    )
    assert seen == [(k, 6) for k in range(1, 7)]
    with imageio.get_reader(tmp_path / "motion.mp4") as video:
        assert video.count_frames() == 6 and video.get_data(0).shape == (60, 80, 3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame.png", "motion.mp4"]


def test_caption_bar_grows_with_the_angle() -> None:
    """The filled part of the bar is as long as the angle over the target's share of it."""
    motion = opening_motion()
    filled = []
    for sample in (0, 5, 10):
        image = caption(motion, sample, 300, 60).astype(int)
        filled.append(int(((image[34, :, 0] - image[34, :, 2]) > 80).sum()))
    assert filled[0] == 0
    assert filled[2] == pytest.approx(252 / 1.15 * 1.0 / 1.25, abs=4)
    assert filled[1] == pytest.approx(filled[2] / 2, abs=4)


def test_unknown_kinds_are_refused(tmp_path: Path) -> None:
    """A suffix that is no picture or video is the user's mistake, and nothing is written."""
    for render, name in ((render_frame, "a.mp4"), (render_filmstrip, "a.txt"), (render_video, "a.png")):
        with pytest.raises(UserError, match="expected a name that ends in"):
            render(opening_motion(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []
