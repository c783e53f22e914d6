"""The border to viser: it writes quaternions wxyz and colours as sRGB bytes, all else here xyzw and linear RGB."""

import numpy as np
from numpy.typing import ArrayLike

from artigrasp.arrays import Array
from artigrasp.export.raycaster import encode_srgb

Rgb = tuple[int, int, int]


def to_wxyz(quaternions: ArrayLike) -> Array:
    """Quaternions xyzw as wxyz, shape ``[..., 4]``."""
    return np.roll(np.asarray(quaternions, np.float64), 1, axis=-1)


def to_xyzw(quaternions: ArrayLike) -> Array:
    """Quaternions wxyz as xyzw, shape ``[..., 4]``."""
    return np.roll(np.asarray(quaternions, np.float64), -1, axis=-1)


def to_srgb(colour: ArrayLike) -> Rgb:
    """A linear RGB colour, each 0 to 1, as sRGB bytes."""
    red, green, blue = encode_srgb(np.clip(np.asarray(colour, np.float64), 0.0, 1.0)).tolist()
    return red, green, blue
