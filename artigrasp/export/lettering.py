"""Words and bars beside pictures."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from matplotlib import font_manager
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from artigrasp.export.raycaster import BACKGROUND, tone_mapped

Rgb = tuple[int, int, int]

PAPER: Rgb = tuple(tone_mapped(BACKGROUND).tolist())
INK, FAINT_INK, TRACK, ACCENT = (45, 48, 54), (140, 144, 152), (219, 221, 225), (226, 132, 52)
SHARPNESS = 3
"""Bands are drawn this many times larger and then reduced."""


class Band:
    """A band of words and bars, laid out as if it were 60 units high.

    Args:
        width: [px].
        height: [px].
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        # Clear paper, so that reduced letters have no dark rim on whatever is behind.
        self._image = Image.new("RGBA", (SHARPNESS * width, SHARPNESS * height), (*PAPER, 0))
        self._draw = ImageDraw.Draw(self._image)
        self._unit = SHARPNESS * height / 60
        self.width = 60 * width / height

    def write(
        self, x: float, y: float, text: str, size: float, colour: Rgb = INK, *, bold: bool = False, right: bool = False
    ) -> float:
        """Write from ``x`` on, or up to there, on the line at ``y``; where the text ends."""
        font = _font(size * self._unit, "bold" if bold else "regular")
        self._draw.text((x * self._unit, y * self._unit), text, colour, font, anchor="rs" if right else "ls")
        return x + self._draw.textlength(text, font) / self._unit

    def bar(self, left: float, top: float, right: float, bottom: float, colour: Rgb) -> None:
        """Draw a bar with round ends, unless it is too short for them."""
        if right - left > bottom - top:
            box = tuple(self._unit * edge for edge in (left, top, right, bottom))
            self._draw.rounded_rectangle(box, self._unit * (bottom - top) / 2, colour)

    def tick(self, x: float, top: float, bottom: float) -> None:
        """Draw a mark across a bar."""
        self._draw.rectangle(tuple(self._unit * edge for edge in (x - 1, top, x + 1, bottom)), INK)

    def image(self, *, transparent: bool = False) -> NDArray[np.uint8]:
        """What was drawn: sRGB, shape ``[height, width, 3]``, or with opacity, shape ``[height, width, 4]``."""
        small = self._image.resize(self._size, Image.Resampling.LANCZOS)
        if transparent:
            return np.asarray(small)
        return np.asarray(Image.alpha_composite(Image.new("RGBA", self._size, PAPER), small).convert("RGB"))


def arrange(cells: Sequence[NDArray[np.uint8]], columns: int) -> NDArray[np.uint8]:
    """Put images of one size side by side in rows, the last of which is filled up with paper, or with nothing."""
    blank = np.zeros_like(cells[0])
    blank[..., :3] = PAPER
    full = [*cells, *[blank] * (-len(cells) % columns)]
    rows = [np.concatenate(full[first : first + columns], axis=1) for first in range(0, len(full), columns)]
    return np.concatenate(rows)


@cache
def _font(size: float, weight: str) -> ImageFont.FreeTypeFont:
    properties = font_manager.FontProperties(family="DejaVu Sans", weight=weight)
    return ImageFont.truetype(font_manager.findfont(properties), size)
