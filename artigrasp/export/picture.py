"""Pictures and videos of a motion."""

import itertools
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.errors import UserError
from artigrasp.export.bodies import (
    box_corners,
    bystander_bodies,
    hand_bodies,
    load_models,
    object_bodies,
    stage_surface,
    target_ghost,
)
from artigrasp.export.camera import CameraName, film
from artigrasp.export.hand_surface import hand_surface
from artigrasp.export.image_file import MOVING_SUFFIXES, STILL_SUFFIXES, check_image, save_image, save_video
from artigrasp.export.lettering import ACCENT, FAINT_INK, TRACK, Band, arrange
from artigrasp.export.raycaster import render_surface
from artigrasp.export.samples import telling_samples
from artigrasp.export.surface import join, place
from artigrasp.motion.file import Motion

Image = NDArray[np.uint8]

CAPTION_SHARE = 1 / 6
"""Height of the caption over that of the picture."""
BLUSH = np.array([0.80, 0.13, 0.08])
"""Linear RGB that hand links turn to where they press on the object."""
STAGE_COLOUR = (0.62, 0.61, 0.60)
"""Linear RGB of a plateau on the table."""
BLUSH_FORCE = 6.0
"""Contact force at which they have turned to it by half [N]."""
LARGEST = 8192
"""Largest width or height of an image [px]."""


@dataclass(frozen=True)
class Style:
    """How a motion is shown.

    Attributes:
        camera: Where the camera is.
        width: Of a frame [px].
        height: Of a frame with its caption [px].
        caption: Whether time, phase and hinge angle are told below.
        target: Whether a ghost shows the object at its target, or the articulated part at the target angle.
        links: Whether hands are shown as the rigid links that collide, without skin.
        transparent: Whether the background is left out.
        grid: A pixel is the mean of ``grid`` by ``grid`` samples.
    """

    camera: CameraName = "three-quarter"
    width: int = 640
    height: int = 480
    caption: bool = True
    target: bool = False
    links: bool = False
    transparent: bool = False
    grid: int = 2

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            if not 16 <= (size := getattr(self, name)) <= LARGEST:
                raise UserError(f"{name}: expected 16 to {LARGEST} pixels, found {size}")
        if not 1 <= self.grid <= 8:
            raise UserError(f"grid: expected 1 to 8 samples each way, found {self.grid}")

    @property
    def caption_height(self) -> int:
        """Of a frame's caption [px]."""
        return round(CAPTION_SHARE * self.height) if self.caption else 0


class MotionPictures:
    """Renders some samples of a motion.

    Attributes:
        views: From where each of them is seen.

    Args:
        motion: The motion.
        samples: Those to be seen, in their order.
        style: How.

    Raises:
        UserError: the motion's hand or object is not among the assets, or there is no such camera.
    """

    def __init__(self, motion: Motion, samples: NDArray[np.integer], style: Style) -> None:
        self._motion, self._samples, self._style = motion, samples, style
        hands, object = load_models(motion)
        bodies = hand_bodies(motion, hands)
        self._hands = [hand_surface(hand, rigid=style.links) for hand in hands]
        self._link_poses = [np.stack([link.poses for link in hand], axis=1) for hand in bodies]
        others = [body for _, bodies, _ in bystander_bodies(motion) for body in bodies]
        self._parts = [*object_bodies(motion, object), *others]
        self._still = [] if motion.stage is None else [stage_surface(motion.stage)]
        self._ghost = target_ghost(motion, object) if style.target else None
        links = box_corners([link for hand in bodies for link in hand], samples)
        parts = box_corners(self._parts, samples)
        ghosts = [] if self._ghost is None else [box_corners([self._ghost], samples)]
        self.views = film(
            style.camera,
            np.concatenate([links, parts, *ghosts], axis=1),
            motion.time[samples],
            links.mean(axis=(0, 1)) - parts.mean(axis=(0, 1)),
            style.width / (style.height - style.caption_height),
        )

    @property
    def count(self) -> int:
        """Of the samples."""
        return len(self._samples)

    def is_same(self, index: int, other: int) -> bool:
        """Whether two of the samples look the same."""
        return bool(self._samples[index] == self._samples[other] and self.views[index] is self.views[other])

    def render(self, index: int) -> Image:
        """Render one of the samples: sRGB, shape ``[height, width, 3]``, or 4 with the opacity if it is transparent."""
        sample, style = self._samples[index], self._style
        force = np.linalg.norm(self._motion.contact_force[sample].sum(axis=-2), axis=-1)[..., None]
        pale = 0.5 ** (force / BLUSH_FORCE)
        colours = [
            BLUSH + hand.of_faces(share) * (hand.colours - BLUSH) for hand, share in zip(self._hands, pale, strict=True)
        ]
        colours += [part.colours for part in self._parts]
        colours += [np.tile(STAGE_COLOUR, (len(surface.faces), 1)) for surface in self._still]
        surfaces = [hand.posed(poses[sample]) for hand, poses in zip(self._hands, self._link_poses, strict=True)]
        surfaces += [place(part.surface, part.poses[sample]) for part in self._parts]
        surfaces += self._still
        image = render_surface(
            join(surfaces),
            np.concatenate(colours),
            self.views[index],
            width=style.width,
            height=style.height - style.caption_height,
            grid=style.grid,
            ghost=None if self._ghost is None else place(self._ghost.surface, self._ghost.poses[sample]),
            transparent=style.transparent,
        )
        if not style.caption:
            return image
        words = caption(self._motion, int(sample), style.width, style.caption_height, transparent=style.transparent)
        return np.concatenate([image, words])


def render_filmstrip(
    motion: Motion | Sequence[Motion],
    path: str | os.PathLike[str],
    *,
    frame_count: int = 5,
    columns: int | None = None,
    titles: Sequence[str] = (),
    style: Style | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write samples of a motion side by side, those that tell most of it, or several motions below each other.

    Args:
        motion: The motion, or several.
        path: The image file.
        frame_count: Number of samples; a motion of fewer is shown whole.
        columns: Samples in a row; all of a motion by default.
        titles: What is said above each motion.
        style: How each is shown.
        progress: Called after each sample with the number of those that are done and that of all.

    Raises:
        UserError: the motion's hand or object is not among the assets, or the file cannot be written.
    """
    style = style or Style(width=300, height=360)
    check_image(path, STILL_SUFFIXES, transparent=style.transparent)
    for name, number in (("frames", frame_count), ("columns", 1 if columns is None else columns)):
        if number < 1:
            raise UserError(f"{name}: expected at least 1, found {number}")
    strips = [MotionPictures(each, telling_samples(each, frame_count), style) for each in _several(motion)]
    longest = max(strip.count for strip in strips)
    columns = min(columns or longest, longest)
    done = _Count(sum(strip.count for strip in strips), progress)
    parts = []
    for strip, title in itertools.zip_longest(strips, titles):
        parts += [] if title is None else [_title(title, columns * style.width, style)]
        parts.append(arrange(list(_render_all(strip, range(strip.count), done)), columns))
    save_image(np.concatenate(parts), path)


def render_video(
    motion: Motion | Sequence[Motion],
    path: str | os.PathLike[str],
    *,
    rate: float = 30.0,
    style: Style | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a motion as a video in real time, or several side by side: H.264, or an animated GIF or WebP.

    Args:
        motion: The motion, or several, of which the shorter ones end in their last picture.
        path: The file, its kind given by the suffix.
        rate: Frames per second.
        style: How it is shown.
        progress: Called after each frame with the number of frames that are done and that of all.

    Raises:
        UserError: the motion's hand or object is not among the assets, the size or the rate cannot be, or the file
            cannot be written.
    """
    style = style or Style()
    check_image(path, MOVING_SUFFIXES, transparent=style.transparent)
    if not 1 <= rate <= 120:
        raise UserError(f"fps: expected 1 to 120 frames per second, found {rate:g}")
    if style.width % 2 or style.height % 2:
        raise UserError(f"expected an even width and height for a video, found {style.width} and {style.height}")
    if Path(path).suffix.lower() == ".gif":
        # Its frames last whole hundredths of a second.
        rate = 100 / round(100 / rate)
    motions = _several(motion)
    duration = max(float(each.time[-1] - each.time[0]) for each in motions)
    moments = np.arange(0, duration + 0.5 / rate, 1 / rate)
    films = [MotionPictures(each, _samples_at(each, moments), style) for each in motions]
    done = _Count(len(films) * len(moments), progress)
    reels = [_render_all(film, range(len(moments)), done) for film in films]
    columns = int(np.ceil(np.sqrt(len(films))))
    save_video((arrange(frames, columns) for frames in zip(*reels, strict=True)), path, rate)


def caption(motion: Motion, sample: int, width: int, height: int, *, transparent: bool = False) -> Image:
    """The band below an image: time, phase and hinge angle, which a bar compares with its target.

    Returns:
        sRGB, shape ``[height, width, 3]``, or with opacity, shape ``[height, width, 4]``, if transparent.
    """
    band = Band(width, height)
    left, right = 24.0, band.width - 24.0
    reached, target = (round(np.degrees(angle)) for angle in (motion.hinge_angle[sample], motion.target_angle))
    end = band.write(left, 20, f"{motion.time[sample]:.2f} s  ", 15, bold=True)
    band.write(end, 20, str(motion.phases[sample]), 13, FAINT_INK)
    band.write(right, 20, f"{reached}° of {target}°", 13, right=True)
    # The bar ends a little beyond the target, so that overshooting shows.
    whole = 1.15 * max(motion.target_angle, 1e-3)
    scale = (right - left) / whole
    band.bar(left, 32, right, 37, TRACK)
    band.bar(left, 32, left + scale * float(np.clip(motion.hinge_angle[sample], 0, whole)), 37, ACCENT)
    band.tick(left + scale * motion.target_angle, 28, 41)
    return band.image(transparent=transparent)


def _title(text: str, width: int, style: Style) -> Image:
    band = Band(width, 36)
    band.write(24, 42, text, 30, bold=True)
    return band.image(transparent=style.transparent)


def _several(motion: Motion | Sequence[Motion]) -> list[Motion]:
    motions = [motion] if isinstance(motion, Motion) else list(motion)
    if not motions:
        raise UserError("expected one or more motions, found none")
    return motions


def _samples_at(motion: Motion, moments: Array) -> NDArray[np.int64]:
    """The samples of a motion at times since its start [s], the last one after its end."""
    samples = np.searchsorted(motion.time - motion.time[0], moments - 1e-6)
    return np.minimum(samples, len(motion.time) - 1)


class _Count:
    """Counts pictures, and tells somebody."""

    def __init__(self, total: int, progress: Callable[[int, int], None] | None) -> None:
        self._done, self._total, self._progress = 0, total, progress

    def add(self) -> None:
        """Count one more."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)


def _render_all(pictures: MotionPictures, indices: Sequence[int], done: _Count) -> Iterator[Image]:
    last: tuple[int, Image] | None = None
    for index in indices:
        # A motion that has ended is not rendered again.
        if last is None or not pictures.is_same(last[0], index):
            last = (index, pictures.render(index))
        done.add()
        yield last[1]
