"""What is shown and how: the toggles of the panel, and the colours and lights that do not change."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from artigrasp.viewer.conventions import Rgb

HandLook = Literal["skin", "links", "hidden"]
HAND_LOOKS: tuple[HandLook, ...] = get_args(HandLook)

TABLE: Rgb = (178, 166, 151)
SKY: tuple[Rgb, Rgb] = ((244, 246, 248), (203, 209, 216))
"""Background from top to bottom."""
REFERENCE_GHOST: Rgb = (90, 150, 235)
TARGET_GHOST: Rgb = (52, 178, 123)
WISH_GHOST: Rgb = (150, 110, 220)
GHOST = 0.35
"""Opacity of ghosts where they are shown at first."""
UNTOUCHED: Rgb = (250, 250, 250)
TOUCHED: Rgb = (48, 190, 110)
PIECES: tuple[Rgb, ...] = (
    (86, 156, 214),
    (245, 166, 35),
    (126, 186, 96),
    (208, 100, 150),
    (150, 120, 210),
    (90, 190, 190),
)
"""Colours of collision pieces, over and over."""

WEAK, STRONG = 0.05, 12.0
"""Contact forces at the ends of the scale of colours [N]; what is weaker is not shown."""
FORCE_COLOURS = np.array([[70, 130, 240], [60, 200, 190], [250, 205, 60], [240, 80, 50]], float)
"""The scale of colours from weak to strong."""
FORCE_STEPS = 6
"""Colours of the scale that arrows have."""


@dataclass(frozen=True)
class Appearance:
    """What is shown.

    Attributes:
        hands: Hands in their skin, as the rigid links that collide, or not at all.
        hand_opacity: Of the hands, to see through to contacts.
        object: Whether the object is shown.
        colliders: Whether the convex pieces that collide are shown instead of its surface.
        contacts: Whether contact points and forces are shown.
        target_contacts: Whether the points are marked that the reference touches.
        reference_ghost: Opacity of the hands of the reference, 0 to hide them.
        target_ghost: Opacity of the object at its target, 0 to hide it.
        fine: Whether there are shadows and rounder hands, which cost time where no graphics card draws.
    """

    hands: HandLook = "skin"
    hand_opacity: float = 1.0
    object: bool = True
    colliders: bool = False
    contacts: bool = True
    target_contacts: bool = False
    reference_ghost: float = 0.0
    target_ghost: float = 0.25
    fine: bool = True


def force_colours() -> NDArray[np.uint8]:
    """The colours that arrows have, from weak to strong, sRGB bytes, shape ``[FORCE_STEPS, 3]``."""
    share = np.linspace(0.0, len(FORCE_COLOURS) - 1, FORCE_STEPS)
    stops = np.arange(len(FORCE_COLOURS))
    channels = [np.interp(share, stops, FORCE_COLOURS[:, channel]) for channel in range(3)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def force_step(force: float) -> int:
    """Which of these colours a force [N] has."""
    return min(int(FORCE_STEPS * force / STRONG), FORCE_STEPS - 1)
