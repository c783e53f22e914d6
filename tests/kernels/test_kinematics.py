"""Forward kinematics against an independent NumPy chain."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.kernels.layout import HANDS
from tests.kernels import numpy_reference
from tests.kernels.launches import launch_forward_kinematics
from tests.kernels.samples import Sample, mirror_poses, mirror_sample, random_sample, to_device


def kinematics(sample: Sample) -> tuple[np.ndarray, np.ndarray]:
    """Link poses [W, H, 16, 7] and keypoints [W, H, 21, 3] of the kernel."""
    device = to_device(sample)
    launch_forward_kinematics(device)
    return device.hands.link_pose.numpy(), device.hands.keypoint.numpy()


def sample_of(hand: str) -> Sample:
    """100 poses of the left and right hands of this name."""
    hands = [load_hand(hand, side) for side in HANDS]
    return replace(
        random_sample(),
        link_offset=np.stack([hand.link_offset for hand in hands]),
        tip_offset=np.stack([hand.tip_offset for hand in hands]),
    )


@pytest.fixture(scope="module")
def sample() -> Sample:
    """The shipped hands."""
    return sample_of("open")


def check_against_numpy(sample: Sample) -> None:
    """All 16 link frames and 21 keypoints are those of an independent chain."""
    link_pose, keypoint = kinematics(sample)
    links, expected_keypoint = numpy_reference.forward_kinematics(sample)
    matrix = numpy_reference.frame(link_pose)[0]
    np.testing.assert_allclose(keypoint, expected_keypoint, atol=1e-6)
    np.testing.assert_allclose(link_pose[..., :3], np.stack([link[1] for link in links], axis=2), atol=1e-6)
    np.testing.assert_allclose(matrix, np.stack([link[0] for link in links], axis=2), atol=2e-6)


def test_links_and_keypoints_agree_with_numpy_to_a_micrometre(sample: Sample) -> None:
    """Both shipped hands, in 100 random poses."""
    check_against_numpy(sample)


@pytest.mark.usefixtures("arctic_assets")
def test_imported_hands_agree_with_numpy_too() -> None:
    """Both MANO-mean hands, in 100 random poses."""
    check_against_numpy(sample_of("mano"))


def test_the_left_hand_is_the_right_one_in_a_mirror(sample: Sample) -> None:
    """Mirrored joint coordinates of the mirrored hand give mirrored link frames and keypoints."""
    link_pose, keypoint = kinematics(sample)
    mirrored_pose, mirrored_keypoint = kinematics(mirror_sample(sample))
    np.testing.assert_allclose(mirrored_keypoint, keypoint * [-1.0, 1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(mirrored_pose, mirror_poses(link_pose), atol=2e-6)
    np.testing.assert_allclose(sample.link_offset[0], sample.link_offset[1] * [-1.0, 1.0, 1.0], atol=1e-9)
