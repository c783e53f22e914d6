"""The directions of slow offsets that a policy decides, and how those of the fingers change their angles."""

from collections.abc import Sequence

import numpy as np

from .layout import DOFS, FINGER_DOF_COUNT, WRIST_DOF_COUNT

FINGER_SYNERGIES = ("finger_flexion", "thumb1_x", "thumb1_y", "thumb1_z", "thumb_flexion")
WRIST_SYNERGIES = ("wrist_tx", "wrist_ty", "wrist_tz", "wrist_rx", "wrist_ry", "wrist_rz")
SYNERGIES = (*WRIST_SYNERGIES, *FINGER_SYNERGIES, "lead", "squeeze", "press")
"""The directions of slow offsets: of the wrist in the manipulated part's frame, of the fingers, of the lead on the
hinge, and of how firmly a closed hand holds. A task uses all or some of them."""
SYNERGY_COUNT = len(SYNERGIES)


def finger_synergy_basis(hands: Sequence[str]) -> np.ndarray:
    """Change of the finger angles per radian of each finger synergy: the common flexion, then four of the thumb.

    Flexion turns about z, positive on a right hand; the two outer thumb joints flex about the axis midway between
    -y and z. Turns about y and z change sign on a left hand.

    Args:
        hands: sides in the scene's order, each ``"left"`` or ``"right"``.

    Returns:
        [H, 5, 45] angles, rad per rad.
    """
    angles = DOFS[WRIST_DOF_COUNT:]
    basis = np.zeros((len(FINGER_SYNERGIES), FINGER_DOF_COUNT), dtype=np.float32)
    for column, name in enumerate(angles):
        if not name.startswith("thumb") and name.endswith("_rz"):
            basis[0, column] = 1.0
    for row, axis in enumerate("xyz", start=1):
        basis[row, angles.index(f"thumb1_r{axis}")] = 1.0
    for joint in ("thumb2", "thumb3"):
        basis[4, angles.index(f"{joint}_ry")] = -np.sqrt(0.5)
        basis[4, angles.index(f"{joint}_rz")] = np.sqrt(0.5)
    mirror = np.where([name.endswith("_rx") for name in angles], 1.0, -1.0)
    return np.stack([basis if hand == "right" else basis * mirror for hand in hands]).astype(np.float32)
