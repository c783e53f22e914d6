"""Hands as kernels read them."""

from collections.abc import Sequence

import numpy as np

from artigrasp.assets.hand_model import HandModel
from artigrasp.kernels import states


def hand_table(hands: Sequence[HandModel], device: str) -> states.HandModel:
    """Offsets and limits of hands, in their order, on a Warp device."""
    table = states.hand_model(len(hands), device)
    for name in states.field_names(states.HandModel):
        getattr(table, name).assign(np.stack([getattr(hand, name) for hand in hands]).astype(np.float32))
    return table
