"""Contacts of recorded hands with the object, measured, for recordings that come without.

The hands are those of MANO's mean shape in the poses that were fitted to a subject's own, so that surfaces that touched
in the recording are some millimetres apart, or overlap: a link touches from a small distance on.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS
from artigrasp.references.arctic_references import base_pose
from artigrasp.references.arctic_sequence import RecordedSequence
from artigrasp.references.hand_distance import link_distances
from artigrasp.references.mano_pose import finger_angles, wrist_pose
from artigrasp.references.poses import to_poses

THICKNESS = 0.03
"""No point of a link's surface is further than this from the points that distances are measured from [m]."""


def measure_contacts(
    model: ObjectModel,
    hands: Sequence[HandModel],
    sequence: RecordedSequence,
    mean_pose: dict[str, Array],
    distance: float,
) -> NDArray[np.bool_]:
    """Contacts as a sequence has them: with the articulated part, the base and either, shape (T, 2, 3, 16).

    Args:
        model: The object.
        hands: Left and right hand, of the mean shape.
        sequence: A recording of T frames.
        mean_pose: MANO's mean pose of each side, shape (45,) [rad].
        distance: A link touches what is nearer than this [m].
    """
    base = base_pose(sequence.object_state).inv()
    wrists = [
        to_poses(base * wrist_pose(sequence.rotation[:, hand], sequence.translation[:, hand], side))
        for hand, side in enumerate(HANDS)
    ]
    angles = [finger_angles(sequence.pose[:, hand] + mean_pose[side]) for hand, side in enumerate(HANDS)]
    distances = link_distances(
        model,
        hands,
        np.stack(wrists, axis=1),
        np.stack(angles, axis=1),
        sequence.object_state[:, 0],
        reach=distance + THICKNESS,
    )
    near = distances < distance
    return np.stack([near[..., ARTICULATED], near[..., BASE], near.any(axis=-1)], axis=2)
