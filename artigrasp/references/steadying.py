"""Which hands, though a reference asks nothing of them, hold the object still in it."""

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_table import put_hands
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import BASE, HANDS
from artigrasp.references.hand_distance import HandDistance, PartMeshes
from artigrasp.references.poses import compose_poses
from artigrasp.references.reference import ReferenceSet

TOUCH_DISTANCE = 0.01
"""A link touches the base from this distance on [m]."""
TOUCHING_LINKS = 2
"""A hand holds the base with so many links at least."""
LEAST_HEIGHT = -0.02
"""Of the links of a hand that steadies an object on the table [m]. Recorded objects were often held in the air, with
fingers beneath them."""


def steadying_hands(references: ReferenceSet, model: ObjectModel) -> NDArray[np.bool_]:
    """Hands that take no part but hold the base in their reference pose, above the table, shape [R, 2].

    Args:
        references: R references.
        model: Their object.
    """
    hands = [load_hand(references.hand, side) for side in HANDS]
    distance = HandDistance(hands, PartMeshes([model], "cpu"), np.zeros(len(references), int))
    base = np.repeat(references.object_pose[:, None], len(HANDS), axis=1)
    put_hands(distance.hands, compose_poses(base, references.wrist_pose_in_part), references.finger_angles)
    # the articulated part is of no interest
    distance.part_pose.assign(np.repeat(references.object_pose[:, None], 2, axis=1))
    distance.launch()
    touching = (distance.link_distance.numpy()[..., BASE] < TOUCH_DISTANCE).sum(axis=2) >= TOUCHING_LINKS
    above = distance.hands.link_pose.numpy()[..., 2].min(axis=2) > LEAST_HEIGHT
    return np.asarray(touching & above & ~references.active & (references.part == BASE))
