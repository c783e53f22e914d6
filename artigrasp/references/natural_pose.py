"""Which finger angles are natural for a hand: a Gaussian of those of recorded references, gathered when it is needed.

Hands of both sides count as right ones. The fewer references there are, the more the Gaussian is its prior's: nothing
about people is known then but how fingers bend, and nothing of anybody's data is kept in this package.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import MIRROR_FINGERS
from artigrasp.assets.library import list_assets
from artigrasp.kernels.layout import DOFS, FINGER_DOF_COUNT, HANDS, LONG_FINGERS, WRIST_DOF_COUNT
from artigrasp.references.reference import ReferenceSet, load_references

PRIOR_DEVIATION = 0.3
"""Standard deviation of each finger angle about zero where nothing is known [rad]."""
PRIOR_COUNT = 45
"""So many poses have as much say as that prior: about as many as it has dimensions."""
SPLIT = "train"
STIFFNESS = 0.06
"""Standard deviation of each finger angle of a relaxed hand besides its motions [rad]."""


@dataclass(frozen=True)
class _Motion:
    """A motion of fingers: the joint angles that it turns [rad per rad], its mean and its standard deviation [rad]."""

    turned: Mapping[str, float]
    mean: float
    deviation: float


_MOTIONS = (
    _Motion({f"{finger}1_rz": 1.0 for finger in LONG_FINGERS}, 0.4, 0.3),
    _Motion(
        {f"{finger}{joint}_rz": share for finger in LONG_FINGERS for joint, share in ((2, 1.0), (3, 0.6))}, 0.4, 0.3
    ),
    *(_Motion({f"{finger}1_rz": 1.0}, 0.0, 0.2) for finger in LONG_FINGERS),
    *(_Motion({f"{finger}2_rz": 1.0, f"{finger}3_rz": 0.6}, 0.0, 0.25) for finger in LONG_FINGERS),
    *(_Motion({f"{finger}1_ry": 1.0}, 0.0, 0.1) for finger in LONG_FINGERS),
    _Motion({"thumb1_rx": 1.0}, 0.35, 0.3),
    _Motion({"thumb1_ry": 1.0}, 0.0, 0.25),
    _Motion({"thumb1_rz": 1.0}, 0.2, 0.25),
    *(
        _Motion({f"{joint}_ry": -np.sqrt(0.5), f"{joint}_rz": np.sqrt(0.5)}, 0.2, 0.25)
        for joint in ("thumb2", "thumb3")
    ),
)
_FINGER_DOFS = DOFS[WRIST_DOF_COUNT:]


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
    mirrored: Array = finger_angles * MIRROR_FINGERS
    return mirrored


def fit_natural_pose(finger_angles: NDArray[np.floating]) -> NaturalPose:
    """The Gaussian of poses of right hands [rad], shape [N, 45], drawn towards a relaxed flat hand's; N may be 0."""
    count = len(finger_angles)
    share = count / (count + PRIOR_COUNT)
    mean = share * (finger_angles.mean(axis=0) if count else np.zeros(FINGER_DOF_COUNT))
    centred = finger_angles - mean
    covariance = (centred.T @ centred + PRIOR_COUNT * PRIOR_DEVIATION**2 * np.eye(FINGER_DOF_COUNT)) / (
        count + PRIOR_COUNT
    )
    return NaturalPose(mean, np.linalg.inv(np.linalg.cholesky(covariance)), count)


def relaxed_pose() -> NaturalPose:
    """The Gaussian of fingers that bend as those of people do, one after the other's example, and hardly turn.

    Made of no recordings: of independent motions such as the curl of a finger, each with a deviation.
    """
    mean, modes = np.zeros(FINGER_DOF_COUNT), []
    for motion in _MOTIONS:
        mode = np.zeros(FINGER_DOF_COUNT)
        for dof, share in motion.turned.items():
            mode[_FINGER_DOFS.index(dof)] = share
        mean += motion.mean * mode
        modes.append(motion.deviation * mode)
    covariance = np.transpose(modes) @ np.array(modes) + STIFFNESS**2 * np.eye(FINGER_DOF_COUNT)
    return NaturalPose(mean, np.linalg.inv(np.linalg.cholesky(covariance)), 0)


def gather_natural_pose(hand: str) -> NaturalPose:
    """Fit the active hands of the references in the split ``train`` of all objects that have some of this hand."""
    return fit_natural_pose(np.concatenate([np.zeros((0, FINGER_DOF_COUNT)), *_training_poses(hand, recorded=False)]))


def recorded_natural_pose(hand: str) -> NaturalPose:
    """As :func:`gather_natural_pose`, but of recorded references alone, and without any a relaxed hand's."""
    poses = _training_poses(hand, recorded=True)
    return fit_natural_pose(np.concatenate(poses)) if poses else relaxed_pose()


def _training_poses(hand: str, *, recorded: bool) -> list[Array]:
    sets = [load_references(name) for name in list_assets("references")]
    poses = [_right_poses(each, recorded=recorded) for each in sets if each.hand == hand]
    return [each for each in poses if len(each)]


def _right_poses(references: ReferenceSet, *, recorded: bool) -> Array:
    chosen = references.split == SPLIT
    if recorded:
        chosen = chosen & (references.sequence != "")
    left, right = (references.finger_angles[chosen & references.active[:, hand], hand] for hand in range(len(HANDS)))
    return np.concatenate([mirror_fingers(left), right])
