"""Hands as kernels read them."""

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_table import hand_table


def test_hands_keep_their_order() -> None:
    """Row 0 is the first hand of the scene."""
    hands = [load_hand("open", side) for side in ("left", "right")]
    table = hand_table(hands, "cpu")
    for name in ("link_offset", "tip_offset", "lower", "upper"):
        expected = np.stack([getattr(hand, name) for hand in hands])
        np.testing.assert_allclose(getattr(table, name).numpy(), expected, atol=1e-6)
