"""References of the shipped lidded box, made by hand for the tests."""

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.kernels.layout import ARTICULATED, DOFS, FINGER_DOF_COUNT, LINK_COUNT, LINKS, WRIST_DOF_COUNT
from artigrasp.references.reference import ReferenceSet

RIGHT = 1
PALM_UP_FROM_FRONT = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
"""Wrist in the lid: fingers towards the box (+y), palm up, thumb to the right."""


def box_references(*, test_count: int = 0) -> ReferenceSet:
    """Three train references and some test references: right hands that hook their fingers under the lid's front rim.

    The one in the middle asks for no contact at all, as a few of ARCTIC's labels do.
    """
    count = 3 + test_count
    poses = np.zeros((count, 2, 7))
    poses[..., 6] = 1.0
    poses[:, RIGHT, 0] = np.resize([0.0, 0.02, -0.02, 0.01, -0.01], count)
    poses[:, RIGHT, 1:3] = -0.235, 0.08
    poses[:, RIGHT, 3:] = PALM_UP_FROM_FRONT.as_quat()
    angles = np.zeros((count, 2, FINGER_DOF_COUNT))
    flexion = [name.endswith("_rz") and "thumb" not in name for name in DOFS[WRIST_DOF_COUNT:]]
    angles[:, RIGHT, flexion] = 0.48
    contacts = np.zeros((count, 2, LINK_COUNT), dtype=bool)
    contacts[:, RIGHT, [LINKS.index(f"{finger}3") for finger in ("index", "middle", "ring")]] = True
    contacts[1] = False
    return ReferenceSet(
        object="lidded-box",
        hand="open",
        kind=np.full(count, "articulate"),
        split=np.array(["train"] * 3 + ["test"] * test_count),
        active=np.tile([False, True], (count, 1)),
        part=np.tile([0, ARTICULATED], (count, 1)),
        wrist_pose_in_part=poses,
        finger_angles=angles,
        contacts=contacts,
        object_pose=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (count, 1)),
        object_angle=np.zeros(count),
        source=np.array([f"made by hand {index}" for index in range(count)]),
    )
