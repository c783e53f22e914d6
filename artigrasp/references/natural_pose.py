"""Which finger angles are natural for a hand: a Gaussian of those of recorded references, gathered when it is needed.

Hands of both sides count as right ones. The fewer references there are, the more the Gaussian is that of a relaxed flat
hand: nothing about people is known then, and nothing of anybody's data is kept in this package.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand_model import MIRROR_ROTATION
from artigrasp.assets.library import list_assets
from artigrasp.kernels.layout import FINGER_DOF_COUNT, HANDS
from artigrasp.references.reference import ReferenceSet, load_references

Array = NDArray[np.float64]

PRIOR_DEVIATION = 0.3
"""Standard deviation of each finger angle about zero where nothing is known [rad]."""
PRIOR_COUNT = 45
"""So many poses have as much say as that prior: about as many as it has dimensions."""
SPLIT = "train"


@dataclass(frozen=True, eq=False)
class NaturalPose:
    """A Gaussian of finger angles of right hands.

    Attributes:
        mean: [rad], shape (45,).
        whitening: Matrix that turns the difference from the mean into independent standard deviations, shape (45, 45).
        count: Recorded poses that it is made of.
    """

    mean: Array
    whitening: Array
    count: int


def mirror_fingers(finger_angles: NDArray[np.floating]) -> Array:
    """Finger angles of the other side's hand in the mirrored pose, shape [..., 45]."""
    mirrored: Array = finger_angles * np.tile(MIRROR_ROTATION, FINGER_DOF_COUNT // 3)
    return mirrored


def fit_natural_pose(finger_angles: NDArray[np.floating]) -> NaturalPose:
    """The Gaussian of poses of right hands [rad], shape [N, 45], drawn towards the prior; N may be 0."""
    count = len(finger_angles)
    share = count / (count + PRIOR_COUNT)
    mean = share * (finger_angles.mean(axis=0) if count else np.zeros(FINGER_DOF_COUNT))
    centred = finger_angles - mean
    covariance = (centred.T @ centred + PRIOR_COUNT * PRIOR_DEVIATION**2 * np.eye(FINGER_DOF_COUNT)) / (
        count + PRIOR_COUNT
    )
    return NaturalPose(mean, np.linalg.inv(np.linalg.cholesky(covariance)), count)


def gather_natural_pose(hand: str) -> NaturalPose:
    """Fit the active hands of the references in the split ``train`` of all objects that have some of this hand."""
    poses = [np.zeros((0, FINGER_DOF_COUNT))]
    for name in list_assets("references"):
        references = load_references(name)
        if references.hand == hand:
            poses.append(_right_poses(references))
    return fit_natural_pose(np.concatenate(poses))


def _right_poses(references: ReferenceSet) -> Array:
    chosen = references.split == SPLIT
    left, right = (references.finger_angles[chosen & references.active[:, hand], hand] for hand in range(len(HANDS)))
    return np.concatenate([mirror_fingers(left), right])
