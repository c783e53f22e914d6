"""Tests of the border to viser."""

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.viewer.conventions import to_srgb, to_wxyz, to_xyzw


def test_quaternions() -> None:
    """The real part goes first, and back, for any number of quaternions."""
    turns = Rotation.random(5, random_state=0)
    np.testing.assert_array_equal(to_wxyz(turns.as_quat()), turns.as_quat(scalar_first=True))
    np.testing.assert_array_equal(to_xyzw(to_wxyz(turns.as_quat()[None])), turns.as_quat()[None])


def test_colours() -> None:
    """Linear 0.2159 is sRGB one half; what is out of range is clipped."""
    assert to_srgb([0.0, 0.2159, 2.0]) == (0, 128, 255)
