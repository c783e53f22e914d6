"""Tests of where a motion puts the links and the parts, against chains of SciPy rotations."""

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import LINK_PARENTS
from artigrasp.motion.kinematics import link_poses, part_poses, reference_link_poses
from tests.motion.example import example_motion

TOLERANCE = 1e-5
"""Largest difference of two positions [m] or of two rotation matrices: float32 against float64."""

Frame = tuple[np.ndarray, Rotation]


def assert_same_frame(pose: np.ndarray, frame: Frame) -> None:
    """A pose (position, quaternion xyzw) is the frame."""
    np.testing.assert_allclose(pose[:3], frame[0], atol=TOLERANCE)
    np.testing.assert_allclose(Rotation.from_quat(pose[3:]).as_matrix(), frame[1].as_matrix(), atol=TOLERANCE)


def frames_of_links(hand: HandModel, base: Frame, joint_q: np.ndarray) -> list[Frame]:
    """The frames of all links: each joint moves by its offset, then turns about its x, y and z."""
    frames: list[Frame] = []
    for link, parent in enumerate(LINK_PARENTS):
        origin, turn = base if parent < 0 else frames[parent]
        offset = joint_q[:3] if parent < 0 else hand.link_offset[link]
        angles = joint_q[3 + 3 * link : 6 + 3 * link]
        frames.append((origin + turn.apply(offset), turn * Rotation.from_euler("XYZ", angles)))
    return frames


def test_links_follow_the_joints() -> None:
    """Every link of both hands is where an independent chain puts it, at every sample."""
    motion = example_motion(hands=("left", "right"))
    hands = [load_hand("open", side) for side in motion.hands]
    poses = link_poses(motion, hands)
    for sample in range(len(motion.time)):
        for index, hand in enumerate(hands):
            base = motion.hand_base[index]
            frames = frames_of_links(
                hand, (base[:3], Rotation.from_quat(base[3:])), motion.joint_q[sample, index].astype(float)
            )
            for pose, frame in zip(poses[sample, index], frames, strict=True):
                assert_same_frame(pose, frame)


def test_reference_is_given_in_its_part() -> None:
    """The links of a reference start from its wrist, in the frame of the part."""
    motion = example_motion(hands=("left", "right"))
    assert motion.reference is not None
    hands = [load_hand("open", side) for side in motion.hands]
    poses = reference_link_poses(motion.reference, hands)
    for index, hand in enumerate(hands):
        wrist = motion.reference.wrist_pose_in_part[index]
        joint_q = np.concatenate([np.zeros(6), motion.reference.finger_angles[index]])
        frames = frames_of_links(hand, (wrist[:3], Rotation.from_quat(wrist[3:])), joint_q)
        for pose, frame in zip(poses[index], frames, strict=True):
            assert_same_frame(pose, frame)


def test_parts_turn_about_the_hinge() -> None:
    """The base is the object's pose, and the articulated part is turned about the hinge from there."""
    motion = example_motion()
    model = load_object("lidded-box")
    poses = part_poses(motion, model)
    np.testing.assert_allclose(poses[:, 0], motion.object_pose, atol=TOLERANCE)
    for sample, angle in enumerate(motion.hinge_angle):
        position, orientation = model.articulated_pose_in_base(float(angle))
        base = motion.object_pose[sample]
        turn = Rotation.from_quat(base[3:])
        frame = base[:3] + turn.apply(position), turn * Rotation.from_quat(orientation)
        assert_same_frame(poses[sample, 1], frame)
