"""The hands at hand: load one by name."""

from artigrasp.assets.hand_model import Box, Capsule, Collider, HandModel, mirror
from artigrasp.assets.hand_usd import read_hand, write_hand
from artigrasp.assets.library import find_asset

__all__ = ["Box", "Capsule", "Collider", "HandModel", "load_hand", "mirror", "read_hand", "write_hand"]


def load_hand(name: str, side: str) -> HandModel:
    """Load a hand from the asset roots.

    Args:
        name: Name of the hand, such as ``"open"`` or ``"mano"``.
        side: ``"left"`` or ``"right"``.

    Raises:
        UserError: there is no such hand, or its file is malformed.
    """
    return read_hand(find_asset("hands", f"{name}_{side}"))
