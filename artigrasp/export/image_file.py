"""Image files, still and moving, written whole or not at all."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from artigrasp.errors import UserError
from artigrasp.files import atomic_write, check_target

STILL_SUFFIXES = (".png", ".jpg", ".webp")
MOVING_SUFFIXES = (".mp4", ".gif", ".webp")
CLEAR_SUFFIXES = (".png", ".webp")
"""Files that can be transparent."""


def check_image(path: str | os.PathLike[str], suffixes: Sequence[str], *, transparent: bool = False) -> None:
    """Refuse an image file that could not be written, before the work that it is to hold.

    Args:
        path: The file.
        suffixes: What its name may end in.
        transparent: Whether the image has an opacity.

    Raises:
        UserError: It is of another kind, of one that cannot be transparent, or cannot be written.
    """
    if transparent:
        suffixes = [suffix for suffix in suffixes if suffix in CLEAR_SUFFIXES]
    if Path(path).suffix.lower() not in suffixes:
        what = "a transparent picture" if transparent else "a name"
        raise UserError(f"{path}: expected {what} that ends in {' or '.join(suffixes)}")
    check_target(path)


def save_image(image: NDArray[np.uint8], path: str | os.PathLike[str]) -> None:
    """Write one image, sRGB with or without opacity, shape ``[height, width, 3 or 4]``."""
    with atomic_write(path) as temporary:
        Image.fromarray(image).save(temporary)


def save_video(frames: Iterable[NDArray[np.uint8]], path: str | os.PathLike[str], rate: float) -> None:
    """Write images of one size as a video, H.264 for ``.mp4``, else an endless animation.

    Args:
        frames: Frames, sRGB, with opacity only for an animation, of even width and height for H.264.
        path: The file.
        rate: Frames per second.
    """
    with atomic_write(path) as temporary:
        if temporary.suffix.lower() == ".mp4":
            writer = imageio.get_writer(
                temporary, fps=rate, codec="libx264", quality=8, macro_block_size=2, ffmpeg_log_level="error"
            )
            # A writer as a context does not stop its process after an error, which then writes on.
            with closing(writer) as video:
                for frame in frames:
                    video.append_data(frame)
            imageio.get_reader(temporary).close()  # ffmpeg ends without a word where the disk was full
        else:
            images: Iterator[Image.Image] = (Image.fromarray(frame) for frame in frames)
            next(images).save(temporary, save_all=True, append_images=images, duration=round(1000 / rate), loop=0)
