"""The references that are shipped with the lidded box: hands that take hold of the lid."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import Box, load_hand
from artigrasp.assets.library import packaged_root
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS, LINK_COUNT, WRIST_DOF_COUNT
from artigrasp.motion.file import MotionReference
from artigrasp.motion.kinematics import reference_link_poses
from artigrasp.references.reference import ReferenceSet, read_references

RIGHT = HANDS.index("right")
CONTACT_DISTANCE = 0.006


@pytest.fixture(scope="module")
def references() -> ReferenceSet:
    """The shipped references for opening the box."""
    return read_references(packaged_root() / "references" / "lidded-box.npz").select(kind="articulate")


@pytest.fixture(scope="module")
def gaps(references: ReferenceSet) -> np.ndarray:
    """Distances of the right hand's links from the blocks around the closed box's parts [R, 16, 2], negative inside."""
    hand = load_hand(references.hand, "right")
    solids = [(part.vertices.min(axis=0), part.vertices.max(axis=0)) for part in load_object(references.object).parts]
    gaps = np.full((len(references), LINK_COUNT, len(solids)), np.inf)
    for index in range(len(references)):
        reference = MotionReference(
            part=references.part[index, [RIGHT]],
            wrist_pose_in_part=references.wrist_pose_in_part[index, [RIGHT]],
            finger_angles=references.finger_angles[index, [RIGHT]],
        )
        poses = reference_link_poses(reference, [hand])[0]
        for link, (pose, colliders) in enumerate(zip(poses, hand.colliders, strict=True)):
            for shape in colliders:
                if isinstance(shape, Box):
                    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 12)] * 3), axis=-1).reshape(-1, 3)
                    local, radius = grid * shape.extents, 0.0
                else:
                    local = np.outer(np.linspace(-0.5, 0.5, 30), [0.0, 0.0, shape.length])
                    radius = shape.radius
                in_link = Rotation.from_quat(shape.orientation).apply(local) + shape.position
                points = Rotation.from_quat(pose[3:]).apply(in_link) + pose[:3]
                for solid, (low, high) in enumerate(solids):
                    beyond = np.maximum(low - points, points - high)
                    distance = np.linalg.norm(beyond.clip(min=0), axis=1) + beyond.max(axis=1).clip(max=0)
                    gaps[index, link, solid] = min(gaps[index, link, solid], (distance - radius).min())
    return gaps


def test_there_are_enough_of_both_splits(references: ReferenceSet) -> None:
    """Right hands that articulate the closed lid, no pose twice."""
    assert (references.object, references.hand) == ("lidded-box", "open")
    assert (references.kind == "articulate").all()
    assert (references.split == "train").sum() >= 6 and (references.split == "test").sum() >= 4
    assert references.active[:, RIGHT].all() and not references.active[:, 1 - RIGHT].any()
    assert (references.part[:, RIGHT] == ARTICULATED).all() and (references.part[:, 1 - RIGHT] == BASE).all()
    assert not references.object_angle.any()
    np.testing.assert_array_equal(references.object_pose, np.tile([0, 0, 0, 0, 0, 0, 1], (len(references), 1)))
    assert len(set(references.source)) == len(references)
    positions = references.wrist_pose_in_part[:, RIGHT, :3]
    assert len(np.unique(np.round(positions, 4), axis=0)) == len(references)


def test_hands_touch_the_lid_without_being_inside(references: ReferenceSet, gaps: np.ndarray) -> None:
    """Target contacts are the links near the lid, among them a last phalanx, and nothing is deep inside the box."""
    assert gaps.min() > -0.005
    contacts = references.contacts[:, RIGHT]
    assert (contacts.sum(axis=1) >= 2).all()
    assert contacts[:, 3::3].any(axis=1).all()
    # Sampled points come within a fraction of a millimetre of the true distance.
    assert gaps[..., ARTICULATED][contacts].max() < CONTACT_DISTANCE + 0.0015
    assert gaps[..., ARTICULATED][~contacts].min() > CONTACT_DISTANCE - 0.0015


def test_hands_are_where_hands_can_be(references: ReferenceSet) -> None:
    """Wrists are above the table and outside the walls, and joints within their limits."""
    wrist = references.wrist_pose_in_part[:, RIGHT, :3]
    assert (wrist[:, 2] > 0.05).all()
    walls = load_object("lidded-box").parts[BASE].vertices
    assert ((wrist < walls.min(axis=0)) | (wrist > walls.max(axis=0))).any(axis=1).all()
    hand = load_hand("open", "right")
    angles = references.finger_angles[:, RIGHT]
    assert (angles > hand.lower[WRIST_DOF_COUNT:] - 1e-6).all()
    assert (angles < hand.upper[WRIST_DOF_COUNT:] + 1e-6).all()


def test_both_hands_can_grasp_the_box() -> None:
    """Grasps of both splits, the left hand a mirror image of the right, with fingertips on the walls."""
    grasps = read_references(packaged_root() / "references" / "lidded-box.npz").select(kind="grasp")
    assert (grasps.split == "train").sum() >= 6 and (grasps.split == "test").sum() >= 4
    assert grasps.active.all() and (grasps.part == BASE).all() and not grasps.object_angle.any()
    left, right = grasps.wrist_pose_in_part[:, 0], grasps.wrist_pose_in_part[:, RIGHT]
    np.testing.assert_allclose(left, right * [-1, 1, 1, 1, -1, -1, 1], atol=1e-6)
    mirror = np.tile([1.0, -1.0, -1.0], LINK_COUNT - 1)
    np.testing.assert_allclose(grasps.finger_angles[:, 0], grasps.finger_angles[:, RIGHT] * mirror, atol=1e-6)
    assert (grasps.contacts[:, :, 3:13:3].sum(axis=2) >= 3).all()
    assert (right[:, 0] > load_object("lidded-box").parts[BASE].vertices[:, 0].max()).all()
