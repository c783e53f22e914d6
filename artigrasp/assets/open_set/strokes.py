"""Letters and digits of thin strokes, to be read on labels and displays."""

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.solids import Solid, detail, prism

_STROKES = {
    "0": "ag gi ic ca", "1": "bh", "2": "ac cf fd dg gi", "3": "ac ci ig df", "C": "ca ag gi", "E": "ca ag gi de",
    "H": "ag ci df", "K": "ag cd di", "N": "ga ai ic", "O": "ag gi ic ca", "P": "ga ac cf fd", "S": "ca ad df fi ig",
    "T": "ac bh", "U": "ag gi ic",
}  # fmt: skip
"""Strokes from point to point of a grid of three by three: ``abc`` above, ``def`` in the middle, ``ghi`` below."""
_WIDTH, _PITCH, _THICK = 0.55, 0.85, 0.14
"""Of a letter, from one to the next, and of a stroke, over the letters' height."""
_DEPTH = 0.0004
"""How far they stand out [m]."""


def letters(text: str, height: float, colour: Colour) -> list[Solid]:
    """Words on the plane y = 0, to be read from -y, their middle at the origin.

    Args:
        text: What to write; a colon is two dots.
        height: Of the letters [m].
        colour: Of the letters.
    """
    widths = [0.3 if letter == ":" else _PITCH for letter in text]
    start = -(sum(widths) - (_PITCH - _WIDTH)) / 2
    flat: list[Solid] = []
    for letter, width in zip(text, widths, strict=True):
        for begin, end in _lines(letter):
            line = np.array([begin, end]) + np.array([start, 0.0])
            along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0]) * _THICK / 2
            across = np.array([-along[1], along[0]])
            corners = [line[0] - along - across, line[1] + along - across, line[1] + along + across]
            corners.append(line[0] - along + across)
            flat.append(detail(prism(height * np.array(corners), -0.0001, _DEPTH, colour)))
        start += width
    upright = Rotation.from_euler("x", 90, degrees=True)
    return [solid.moved(rotation=upright) for solid in flat]


def _lines(letter: str) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    if letter == ":":
        return [((0.0, y), (0.02, y)) for y in (-0.2, 0.2)]
    grid = {name: (_WIDTH * (index % 3) / 2, 0.5 - index // 3 / 2) for index, name in enumerate("abcdefghi")}
    return [(grid[stroke[0]], grid[stroke[1]]) for stroke in _STROKES.get(letter, "").split()]
