"""Pictures and videos of a motion."""

import itertools
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
from matplotlib import font_manager
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial.transform import Rotation

from artigrasp.errors import UserError
from artigrasp.export.bodies import Body, hand_bodies, load_models, object_bodies
from artigrasp.export.camera import View, three_quarter_view
from artigrasp.export.raycaster import BACKGROUND, render_surface, to_srgb
from artigrasp.export.surface import Surface, join, place
from artigrasp.files import atomic_write
from artigrasp.motion.file import Motion

IMAGE_SUFFIXES = (".png", ".jpg", ".webp")
VIDEO_SUFFIXES = (".mp4",)

CAPTION_SHARE = 1 / 6
"""Height of the caption over that of the picture."""
PAPER = tuple(to_srgb(BACKGROUND).tolist())
INK, FAINT_INK, TRACK, ACCENT = (45, 48, 54), (140, 144, 152), (219, 221, 225), (226, 132, 52)
SHARPNESS = 3
"""Captions are drawn this many times larger and then reduced."""

BLUSH = np.array([0.80, 0.13, 0.08])
"""Linear RGB that hand links turn to where they press on the object."""
BLUSH_FORCE = 6.0
"""Contact force at which they have turned to it by half [N]."""


class MotionPictures:
    """Renders samples of one motion with one camera.

    Args:
        motion: The motion.
        samples: The samples of it that the camera must see whole.
        width: Of an image [px].
        height: Of an image [px].

    Raises:
        UserError: the motion's hand or object is not among the assets.
    """

    def __init__(
        self, motion: Motion, samples: Sequence[int] | NDArray[np.integer], *, width: int, height: int
    ) -> None:
        self._motion, self._width, self._height = motion, width, height
        hands, object = load_models(motion)
        self._links = [body for hand in hand_bodies(motion, hands) for body in hand]
        self._parts = object_bodies(motion, object)
        self._view = _view(self._links, self._parts, samples, width / height)

    def render(self, sample: int, *, grid: int = 2) -> NDArray[np.uint8]:
        """Render one sample of the motion: sRGB, shape ``[height, width, 3]``."""
        bodies = [*self._links, *self._parts]
        surface = join([place(body.surface, body.poses[sample]) for body in bodies])
        force = np.linalg.norm(self._motion.contact_force[sample].sum(axis=-2), axis=-1).ravel()
        blush = np.append(1 - 0.5 ** (force / BLUSH_FORCE), np.zeros(len(self._parts)))
        colours = [
            np.broadcast_to((1 - share) * np.array(body.colour) + share * BLUSH, body.surface.faces.shape)
            for body, share in zip(bodies, blush, strict=True)
        ]
        return render_surface(
            surface, np.concatenate(colours), self._view, width=self._width, height=self._height, grid=grid
        )


def render_frame(
    motion: Motion, path: str | os.PathLike[str], *, sample: int = -1, width: int = 960, height: int = 720
) -> None:
    """Write a picture of one sample of a motion.

    Args:
        motion: The motion.
        path: The image file, its kind given by the suffix.
        sample: Index of the sample.
        width: Of the picture [px].
        height: Of the picture [px].

    Raises:
        UserError: the motion's hand or object is not among the assets, or the file cannot be written.
    """
    _check_suffix(path, IMAGE_SUFFIXES)
    _save(MotionPictures(motion, [sample], width=width, height=height).render(sample), path)


def render_filmstrip(
    motion: Motion, path: str | os.PathLike[str], *, frame_count: int = 5, width: int = 1500, height: int = 360
) -> None:
    """Write a strip of samples of a motion, side by side, with their time, phase and hinge angle.

    The samples are the first, the last and some between, closer together where the hinge turns faster.

    Args:
        motion: The motion.
        path: The image file, its kind given by the suffix.
        frame_count: Number of samples.
        width: Of the picture [px].
        height: Of the picture [px].

    Raises:
        UserError: the motion's hand or object is not among the assets, or the file cannot be written.
    """
    _check_suffix(path, IMAGE_SUFFIXES)
    caption_height = round(CAPTION_SHARE * height)
    samples = _telling_samples(motion, frame_count)
    pictures = MotionPictures(motion, samples, width=width // frame_count, height=height - caption_height)
    frames = [
        np.concatenate([pictures.render(sample), caption(motion, sample, width // frame_count, caption_height)])
        for sample in samples
    ]
    _save(np.concatenate(frames, axis=1), path)


def render_video(
    motion: Motion,
    path: str | os.PathLike[str],
    *,
    rate: float = 30.0,
    width: int = 640,
    height: int = 480,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a motion as an H.264 video in real time.

    Args:
        motion: The motion.
        path: The ``.mp4`` file.
        rate: Frames per second.
        width: Of the video [px], even.
        height: Of the video [px], even.
        progress: Called after each frame with the number of frames written and that of all.

    Raises:
        UserError: the motion's hand or object is not among the assets, or the file cannot be written.
    """
    _check_suffix(path, VIDEO_SUFFIXES)
    caption_height = round(CAPTION_SHARE * height)
    time = motion.time - motion.time[0]
    samples = np.searchsorted(time, np.arange(0, time[-1] + 0.5 / rate, 1 / rate) - 1e-6).clip(max=len(time) - 1)
    pictures = MotionPictures(motion, samples, width=width, height=height - caption_height)
    with (
        atomic_write(path) as temporary,
        imageio.get_writer(temporary, fps=rate, codec="libx264", quality=8, macro_block_size=2) as video,
    ):
        for index, sample in enumerate(samples):
            image = pictures.render(sample, grid=1)
            video.append_data(np.concatenate([image, caption(motion, sample, width, caption_height)]))
            if progress is not None:
                progress(index + 1, len(samples))


def caption(motion: Motion, sample: int, width: int, height: int) -> NDArray[np.uint8]:
    """The band below an image: time, phase and hinge angle, which a bar compares with its target.

    Returns:
        sRGB, shape ``[height, width, 3]``.
    """
    band = Image.new("RGB", (SHARPNESS * width, SHARPNESS * height), PAPER)
    draw = ImageDraw.Draw(band)
    unit = SHARPNESS * height / 60
    left, right = 24 * unit, SHARPNESS * width - 24 * unit
    angles = np.degrees([motion.hinge_angle[sample], motion.target_angle])
    draw.text((left, 20 * unit), f"{motion.time[sample]:.2f} s", INK, _font(15 * unit, "bold"), anchor="ls")
    offset = draw.textlength(f"{motion.time[sample]:.2f} s  ", _font(15 * unit, "bold"))
    draw.text((left + offset, 20 * unit), str(motion.phases[sample]), FAINT_INK, _font(13 * unit), anchor="ls")
    draw.text((right, 20 * unit), f"{angles[0]:.0f}° of {angles[1]:.0f}°", INK, _font(13 * unit), anchor="rs")
    # The bar ends a little beyond the target, so that overshooting shows.
    scale = (right - left) / (1.15 * max(motion.target_angle, 1e-3))
    reached = left + scale * np.clip(motion.hinge_angle[sample], 0, 1.15 * max(motion.target_angle, 1e-3))
    top, bottom, round_end = 32 * unit, 37 * unit, 2.5 * unit
    draw.rounded_rectangle((left, top, right, bottom), round_end, TRACK)
    if reached - left > 2 * round_end:
        draw.rounded_rectangle((left, top, reached, bottom), round_end, ACCENT)
    target = left + scale * motion.target_angle
    draw.rectangle((target - unit, top - 4 * unit, target + unit, bottom + 4 * unit), INK)
    return np.asarray(band.resize((width, height), Image.Resampling.LANCZOS))


def _view(
    links: Sequence[Body], parts: Sequence[Body], samples: Sequence[int] | NDArray[np.integer], aspect: float
) -> View:
    """Look at the hands and the object from beside the direction, seen from the object, in which the hands are."""
    seen = []
    for body in (*links, *parts):
        poses = body.poses[samples]
        turn = Rotation.from_quat(poses[:, 3:]).as_matrix()
        seen.append(np.einsum("tij,cj->tci", turn, _box_corners(body.surface)) + poses[:, None, :3])
    hands = np.mean([points.mean(axis=(0, 1)) for points in seen[: len(links)]], axis=0)
    object = np.mean([points.mean(axis=(0, 1)) for points in seen[len(links) :]], axis=0)
    return three_quarter_view(np.concatenate(seen).reshape(-1, 3), hands - object, aspect)


def _box_corners(surface: Surface) -> NDArray[np.float64]:
    """Corners of the box around a surface, along the axes of its frame [m], shape ``[8, 3]``."""
    bounds = np.stack([surface.vertices.min(axis=0), surface.vertices.max(axis=0)], axis=1)
    return np.array(list(itertools.product(*bounds)))


def _telling_samples(motion: Motion, count: int) -> NDArray[np.int64]:
    """Samples at equal steps of time and of turning of the hinge, each of which counts one half."""
    time = motion.time - motion.time[0]
    turning = np.cumsum(np.abs(np.diff(motion.hinge_angle, prepend=motion.hinge_angle[0])))
    course = time / max(time[-1], 1e-9) + turning / max(turning[-1], 1e-9)
    return np.searchsorted(course, np.linspace(0, course[-1], count) - 1e-9)


def _font(size: float, weight: str = "regular") -> ImageFont.FreeTypeFont:
    properties = font_manager.FontProperties(family="DejaVu Sans", weight=weight)
    return ImageFont.truetype(font_manager.findfont(properties), size)


def _check_suffix(path: str | os.PathLike[str], suffixes: Sequence[str]) -> None:
    if Path(path).suffix.lower() not in suffixes:
        raise UserError(f"{path}: expected a name that ends in {' or '.join(suffixes)}")


def _save(image: NDArray[np.uint8], path: str | os.PathLike[str]) -> None:
    with atomic_write(path) as temporary:
        Image.fromarray(image).save(temporary)
