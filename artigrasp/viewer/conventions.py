"""The border to viser: it writes quaternions wxyz and colours as sRGB bytes, all else here xyzw and linear RGB."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Rgb = tuple[int, int, int]


def to_wxyz(quaternions: ArrayLike) -> NDArray[np.float64]:
    """Quaternions xyzw as wxyz, shape ``[..., 4]``."""
    return np.roll(np.asarray(quaternions, np.float64), 1, axis=-1)


def to_xyzw(quaternions: ArrayLike) -> NDArray[np.float64]:
    """Quaternions wxyz as xyzw, shape ``[..., 4]``."""
    return np.roll(np.asarray(quaternions, np.float64), -1, axis=-1)


def to_srgb(colour: ArrayLike) -> Rgb:
    """A linear RGB colour, each 0 to 1, as sRGB bytes."""
    linear = np.clip(np.asarray(colour, np.float64), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    red, green, blue = (int(value) for value in np.round(255 * encoded))
    return red, green, blue
