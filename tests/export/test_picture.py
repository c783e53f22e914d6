"""Tests of pictures and videos: what must be seen is seen, where it should be, and nothing is cut off."""

import dataclasses
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
import pytest
import trimesh
from PIL import Image

from artigrasp.config import StageConfig
from artigrasp.errors import UserError
from artigrasp.export.bodies import hand_bodies, load_models
from artigrasp.export.camera import CAMERAS, View, look_at
from artigrasp.export.lettering import PAPER
from artigrasp.export.picture import MotionPictures, Style, caption, render_filmstrip, render_video
from artigrasp.export.raycaster import render_surface, visibility
from artigrasp.export.surface import Surface, mesh_surface
from artigrasp.motion.file import Motion, MotionBystanders
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


def box_on_floor() -> Surface:
    """A cube of 10 cm on the floor."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.apply_translation((0, 0, 0.05))
    return mesh_surface(box.vertices, box.faces)


GROUND = np.array([[x, y, 0.0] for x in (-0.4, 0.4) for y in (-0.4, 0.4)])
FRONT = (np.radians(-40.0), np.radians(28.0))


def test_a_lit_body_stands_on_the_floor() -> None:
    """The middle of the image has the body's colour, its borders are plain, and the floor beside it is in shadow."""
    surface = box_on_floor()
    view = look_at(np.concatenate([GROUND, surface.vertices]), FRONT, 1.5)
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


def test_a_transparent_background_keeps_the_shadow() -> None:
    """The body is opaque and has its colour, the floor is clear, and its shadow is black and partly there."""
    surface = box_on_floor()
    view = look_at(np.concatenate([GROUND, surface.vertices]), FRONT, 1.5)
    colours = np.broadcast_to(RED, (12, 3))
    opaque = render_surface(surface, colours, view, width=90, height=60)
    clear = render_surface(surface, colours, view, width=90, height=60, transparent=True)
    assert clear.shape == (60, 90, 4)
    assert clear[30, 45, 3] == 255 and (clear[30, 45, :3] == opaque[30, 45]).all()
    assert clear[0, 0, 3] <= 2
    away_from_sun = -0.09 * view.sun[:2] / np.linalg.norm(view.sun[:2])
    shadow = clear[pixel(view, np.append(away_from_sun, 0), 90, 60)]
    assert (shadow[:3] == 0).all() and 60 < shadow[3] < 250


def test_a_ghost_is_seen_through() -> None:
    """In front of the body, a ghost changes its colour towards its own but leaves its shading; behind, it is hidden."""
    surface = box_on_floor()
    view = look_at(np.concatenate([GROUND, surface.vertices]), FRONT, 1.5)
    before, behind = (
        Surface(surface.vertices - sign * 0.3 * view.forward, surface.faces, surface.corner_normals) for sign in (1, -1)
    )
    colours = np.broadcast_to(RED, (12, 3))
    plain, through, hidden = (
        render_surface(surface, colours, view, width=90, height=60, ghost=ghost)[30, 45].astype(int)
        for ghost in (None, before, behind)
    )
    assert (hidden == plain).all()
    assert through[0] < plain[0] - 10 and through[1] > plain[1] + 10


def test_visibility_is_the_slant_of_what_is_not_hidden() -> None:
    """Seen from straight above: the top of the cube squarely, its sides not at all, a plate below it not either.

    From between above and the right all three are seen aslant.
    """
    cube = box_on_floor()
    points = np.array([[0.02, 0.01, 0.1], [0.05, 0.01, 0.05], [0, 0, -0.1]])
    normals = np.array([[0.0, 0, 1], [1, 0, 0], [0, 0, 1]])
    directions = np.array([[0.0, 0, 1], [np.sqrt(0.5), 0, np.sqrt(0.5)]])
    np.testing.assert_allclose(
        visibility(cube, points, normals, directions), [[1, 0, 0], np.full(3, np.sqrt(0.5))], atol=1e-6
    )


@pytest.mark.parametrize("camera", CAMERAS)
def test_hands_are_where_kinematics_say(camera: str) -> None:
    """Through every camera, each part of the hand that nothing hides is seen where forward kinematics have it."""
    motion = opening_motion()
    samples = np.array([0, 5, 10])
    style = Style(camera=camera, width=200, height=200, caption=False, grid=1)
    pictures = MotionPictures(motion, samples, style)
    links = hand_bodies(motion, load_models(motion)[0])[0]
    seen = 0
    for index in (0, 2):
        image = pictures.render(index)
        for link in links:
            middle = link.poses[samples[index], :3]
            row, column = pixel(pictures.views[index], middle, 200, 200)
            assert 0 <= row < 200 and 0 <= column < 200
            red, _, blue = image[row, column].astype(int)
            seen += red > blue + 25
    assert seen > 0.75 * 2 * len(links)


def test_filmstrip_shows_the_whole_motion(tmp_path: Path) -> None:
    """The strip has its size, every frame shows something, and nothing touches the upper border."""
    render_filmstrip(
        opening_motion(), tmp_path / "strip.png", frame_count=3, style=Style(links=True, width=120, height=120)
    )
    image = imageio.imread(tmp_path / "strip.png")
    assert image.shape == (120, 360, 3)
    assert paper_like(image[0]).all()
    for frame in np.split(image[:100], 3, axis=1):
        assert 0.05 < (~paper_like(frame)).mean() < 0.8
    assert (image[:100, :120] != image[:100, 240:]).any()


def test_a_video_is_as_asked_for(tmp_path: Path) -> None:
    """It has the size and the length, and progress is told."""
    motion = opening_motion()
    style = Style(links=True, width=80, height=60, grid=1)
    seen: list[tuple[int, int]] = []
    render_video(motion, tmp_path / "motion.mp4", rate=5, style=style, progress=lambda *counts: seen.append(counts))
    assert seen == [(k, 6) for k in range(1, 7)]
    with imageio.get_reader(tmp_path / "motion.mp4") as video:
        assert video.count_frames() == 6 and video.get_data(0).shape == (60, 80, 3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["motion.mp4"]


def test_animations_keep_time_and_can_be_transparent(tmp_path: Path) -> None:
    """An animated WebP has clear corners and an opaque box in every frame; a GIF lasts as long as the motion."""
    motion = opening_motion()
    render_video(
        motion,
        tmp_path / "a.webp",
        rate=4,
        style=Style(links=True, width=80, height=60, caption=False, transparent=True, grid=1),
    )
    with Image.open(tmp_path / "a.webp") as animation:
        assert animation.n_frames == 5
        for frame in range(5):
            animation.seek(frame)
            opacity = np.asarray(animation.convert("RGBA"))[..., 3]
            assert opacity[0, 0] <= 3 and opacity.max() == 255
    render_video(
        motion, tmp_path / "a.gif", rate=30, style=Style(links=True, width=32, height=32, caption=False, grid=1)
    )
    with Image.open(tmp_path / "a.gif") as animation:
        total = 0
        for frame in range(animation.n_frames):
            animation.seek(frame)
            total += animation.info["duration"]
    assert 1000 <= total <= 1060


def test_strip_in_rows(tmp_path: Path) -> None:
    """Five frames in rows of two leave the last place empty: clear in a transparent strip."""
    style = Style(links=True, width=40, height=48, caption=False, transparent=True, grid=1)
    render_filmstrip(opening_motion(), tmp_path / "strip.png", frame_count=5, columns=2, style=style)
    image = imageio.imread(tmp_path / "strip.png")
    assert image.shape == (3 * 48, 80, 4)
    assert (image[96:, 40:, 3] == 0).all() and image[96:, :40, 3].max() == 255


def test_motions_below_and_beside_each_other(tmp_path: Path) -> None:
    """A sheet has a row for each motion; in a video the shorter one waits in its last picture."""
    motions = [opening_motion(), opening_motion(2)]
    style = Style(links=True, width=48, height=48, caption=False, grid=1)
    render_filmstrip(motions, tmp_path / "sheet.png", frame_count=3, style=style)
    sheet = imageio.imread(tmp_path / "sheet.png")
    assert sheet.shape == (2 * 48, 3 * 48, 3)
    assert paper_like(sheet[48:, 96:]).all() and not paper_like(sheet[48:, :96]).all()
    short = dataclasses.replace(motions[1], time=[0.0, 0.2])
    seen: list[tuple[int, int]] = []
    render_video(
        [motions[0], short],
        tmp_path / "both.webp",
        rate=5,
        style=style,
        progress=lambda *counts: seen.append(counts),
    )
    assert seen[-1] == (12, 12)
    with Image.open(tmp_path / "both.webp") as video:
        assert video.size == (96, 48) and video.n_frames == 6


def test_the_whole_scene_is_seen() -> None:
    """Another object and a plateau are in the picture, and the ghost is the object where it should go."""
    motion = opening_motion()
    beside = np.tile([0.5, 0.0, 0.1, 0, 0, 0, 1], (len(motion.time), 1, 1))
    scene = dataclasses.replace(
        motion,
        stage=StageConfig(0.1, (0.3, 0.3), (0.5, 0.0)),
        bystanders=MotionBystanders(
            objects=("open-laptop",),
            pose=beside,
            hinge_angle=np.zeros((len(motion.time), 1)),
            focus=np.zeros(len(motion.time), np.int64),
        ),
        target_object_pose=[-0.5, 0, 0, 0, 0, 0, 1],
    )
    style = Style(links=True, width=96, height=64, caption=False, target=True, grid=1)
    pictures = MotionPictures(scene, np.array([0]), style)
    image = pictures.render(0)
    for place in ([0.5, 0.0, 0.1], [0.5, 0.1, 0.02], [-0.5, 0.0, 0.05]):
        row, column = pixel(pictures.views[0], np.array(place), 96, 64)
        assert not paper_like(image)[row - 1 : row + 2, column - 1 : column + 2].all()


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


@pytest.mark.parametrize(
    ("name", "style", "message"),
    [
        ("a.png", {}, "expected a name that ends in .mp4 or .gif or .webp"),
        ("a.mp4", {"transparent": True}, "expected a transparent picture that ends in .webp"),
        ("a.mp4", {"width": 81}, "expected an even width and height for a video, found 81 and 60"),
        ("a.mp4", {"width": 8}, "width: expected 16 to 8192 pixels, found 8"),
        ("a.mp4", {"grid": 0}, "grid: expected 1 to 8 samples each way, found 0"),
        ("a.mp4", {"camera": "topp"}, "unknown camera 'topp': did you mean 'top'"),
    ],
)
def test_videos_that_cannot_be(tmp_path: Path, name: str, style: dict[str, Any], message: str) -> None:
    """Suffixes, sizes and cameras that cannot be are the user's mistake, and nothing is written."""
    with pytest.raises(UserError, match=message):
        render_video(opening_motion(), tmp_path / name, style=Style(**{"width": 80, "height": 60} | style))
    assert list(tmp_path.iterdir()) == []


def test_a_video_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    """An error between two frames leaves neither half a video nor a temporary file, and an older video as it was."""

    def stop(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    for suffix in ("mp4", "gif"):
        (tmp_path / f"a.{suffix}").write_text("older")
        with pytest.raises(KeyboardInterrupt):
            render_video(
                opening_motion(), tmp_path / f"a.{suffix}", style=Style(links=True, width=32, height=32), progress=stop
            )
        assert (tmp_path / f"a.{suffix}").read_text() == "older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "a.mp4"]


def test_unknown_kinds_are_refused(tmp_path: Path) -> None:
    """A suffix that is no picture or video is the user's mistake, and nothing is written."""
    for render, name in ((render_filmstrip, "a.txt"), (render_video, "a.png")):
        with pytest.raises(UserError, match="expected a name that ends in"):
            render(opening_motion(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []
