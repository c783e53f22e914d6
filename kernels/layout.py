"""The one order of links, joints, keypoints and parts that the whole project uses.

Arrays are indexed ``[world, hand, ...]``; a hand is a tree of 16 links with 51 degrees of freedom.
"""

from dataclasses import dataclass

HANDS = ("left", "right")
"""Hand order of every per-hand array."""

PARTS = ("base", "articulated")
"""Object part order of every per-part array."""
BASE, ARTICULATED = 0, 1

FINGERS = ("index", "middle", "pinky", "ring", "thumb")
"""Finger order of the joints (MANO's)."""

LINKS = ("wrist", *(f"{finger}{joint}" for finger in FINGERS for joint in (1, 2, 3)))
"""The 16 links, which are also the 16 contact links."""
LINK_COUNT = len(LINKS)
LINK_PARENTS = tuple(-1 if link == 0 else 0 if link % 3 == 1 else link - 1 for link in range(LINK_COUNT))

TIP_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
"""Finger order of the five fingertips."""
LONG_FINGERS = TIP_FINGERS[1:]
"""All but the thumb, as they lie side by side."""
TIP_LINKS = tuple(LINKS.index(f"{finger}3") for finger in TIP_FINGERS)
TIP_COUNT = len(TIP_LINKS)

KEYPOINTS = (*LINKS, *(f"{finger}_tip" for finger in TIP_FINGERS))
"""21 keypoints: the 16 joint origins, then the fingertips."""
KEYPOINT_COUNT = len(KEYPOINTS)

WRIST_DOF_COUNT = 6
FINGER_DOF_COUNT = 3 * (LINK_COUNT - 1)
DOF_COUNT = WRIST_DOF_COUNT + FINGER_DOF_COUNT
DOFS = (
    *(f"wrist_t{axis}" for axis in "xyz"),
    *(f"wrist_r{axis}" for axis in "xyz"),
    *(f"{link}_r{axis}" for link in LINKS[1:] for axis in "xyz"),
)
"""51 joint coordinates: 3 wrist translations [m], 3 wrist rotations and 45 finger angles [rad].

Every rotation triple is intrinsic XYZ: ``R = Rx @ Ry @ Rz``.
"""


@dataclass(frozen=True)
class Feature:
    """One block of the feature vector."""

    name: str
    size: int
    frame: str
    unit: str


FEATURES = (
    Feature("finger_angles", FINGER_DOF_COUNT, "joint", "rad"),
    Feature("finger_velocities", FINGER_DOF_COUNT, "joint", "rad/s"),
    Feature("link_forces", LINK_COUNT, "norm", "N, mean over the control step"),
    Feature("wrist_velocity_in_part", 6, "manipulated part", "m/s, rad/s"),
    Feature("part_pose_in_wrist", 7, "wrist", "m, rotation vector rad, hinge angle rad"),
    Feature("part_velocity_in_wrist", 7, "wrist", "m/s, rad/s, hinge rad/s, relative to the wrist"),
    Feature("hinge_in_wrist", 9, "wrist", "axis 1, direction to axis 1, distance m, part masses kg"),
    Feature("pose_error", 48, "manipulated part / joint", "wrist rotation vector rad, finger angles rad"),
    Feature("keypoint_error_in_part", 3 * KEYPOINT_COUNT, "manipulated part", "m"),
    Feature("contact_goal", 2 * LINK_COUNT, "link", "target 0/1, then target minus current"),
    Feature("angle_error", 1, "hinge", "rad"),
)
"""The paper's features (H, O, G): 279 numbers per hand."""
FEATURES_VERSION = 1
FEATURE_COUNT = sum(feature.size for feature in FEATURES)


SUB_BLOCKS = {
    "wrist_rotation_error": ("pose_error", 0, 3),
    "wrist_error_in_part": ("keypoint_error_in_part", 0, 3),
    "target_contacts": ("contact_goal", 0, LINK_COUNT),
}
"""Parts of blocks that have names of their own: the block, and its columns from where to where."""


def feature_slice(name: str) -> slice:
    """Columns of one block in the feature vector, or of a part of one.

    Raises:
        KeyError: there is none of that name.
    """
    if name in SUB_BLOCKS:
        block, begin, end = SUB_BLOCKS[name]
        first = feature_slice(block).start
        return slice(first + begin, first + end)
    start = 0
    for feature in FEATURES:
        if feature.name == name:
            return slice(start, start + feature.size)
        start += feature.size
    raise KeyError(name)
