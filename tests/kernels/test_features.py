"""The feature vector, block by block, against an independent NumPy reference."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.kernels.layout import FEATURE_COUNT, FEATURES, feature_slice
from tests.kernels import numpy_reference
from tests.kernels.launches import launch_features
from tests.kernels.samples import Sample, mirror_sample, random_sample, to_device

VECTOR = [-1.0, 1.0, 1.0]
TURN = [1.0, -1.0, -1.0]
MIRROR = {
    "finger_angles": TURN * 15,
    "finger_velocities": TURN * 15,
    "link_forces": [1.0] * 16,
    "wrist_velocity_in_part": VECTOR + TURN,
    "part_pose_in_wrist": [*VECTOR, *TURN, 1.0],
    "part_velocity_in_wrist": [*VECTOR, *TURN, 1.0],
    "hinge_in_wrist": [*TURN, *VECTOR, 1.0, 1.0, 1.0],
    "pose_error": TURN * 16,
    "keypoint_error_in_part": VECTOR * 21,
    "contact_goal": [1.0] * 32,
    "angle_error": [1.0],
}
"""What a mirror across x = 0 does to every feature."""


@pytest.fixture(scope="module")
def sample() -> Sample:
    """100 random states."""
    return random_sample()


@pytest.fixture(scope="module")
def features(sample: Sample) -> np.ndarray:
    """Their features, [W, H, 279]."""
    return launch_features(to_device(sample)).numpy()


@pytest.fixture(scope="module")
def expected(sample: Sample) -> np.ndarray:
    """The same by NumPy."""
    return numpy_reference.features(sample)


@pytest.mark.parametrize("name", [feature.name for feature in FEATURES])
def test_block_agrees_with_numpy(features: np.ndarray, expected: np.ndarray, name: str) -> None:
    """One block of the table, on every random state."""
    columns = feature_slice(name)
    assert np.isfinite(expected[..., columns]).all()
    np.testing.assert_allclose(features[..., columns], expected[..., columns], rtol=1e-4, atol=2e-5)


def test_the_reference_fills_every_column(expected: np.ndarray) -> None:
    """The blocks cover the whole vector without a gap."""
    assert expected.shape[-1] == FEATURE_COUNT
    assert np.isfinite(expected).all()


def test_hinge_block_can_be_left_out(sample: Sample, features: np.ndarray) -> None:
    """The ablation zeroes the nine hinge numbers and nothing else."""
    ablated = launch_features(to_device(sample), with_hinge=False).numpy()
    hinge = feature_slice("hinge_in_wrist")
    assert (ablated[..., hinge] == 0.0).all()
    np.testing.assert_array_equal(np.delete(ablated, hinge, axis=-1), np.delete(features, hinge, axis=-1))


def test_features_do_not_depend_on_where_the_scene_is(sample: Sample, features: np.ndarray) -> None:
    """Turning and shifting hands and object together changes no feature."""
    turn, shift = numpy_reference.Rotation.from_rotvec([0.3, -0.4, 1.2]), np.array([0.2, -0.3, 0.1])

    def moved(poses: np.ndarray) -> np.ndarray:
        rotations = turn * numpy_reference.Rotation.from_quat(poses[..., 3:].reshape(-1, 4))
        positions = turn.apply(poses[..., :3].reshape(-1, 3)) + shift
        return np.concatenate([positions, rotations.as_quat()], axis=-1).reshape(poses.shape)

    def turned(vectors: np.ndarray) -> np.ndarray:
        return turn.apply(vectors.reshape(-1, 3)).reshape(vectors.shape)

    elsewhere = replace(
        sample,
        hand_base=moved(sample.hand_base),
        pose=moved(sample.pose),
        velocity=turned(sample.velocity),
        contact_force=turned(sample.contact_force),
    )
    np.testing.assert_allclose(launch_features(to_device(elsewhere)).numpy(), features, rtol=1e-4, atol=2e-5)


def test_left_features_are_right_features_in_a_mirror(sample: Sample, features: np.ndarray) -> None:
    """The mirrored scene has the same features up to the signs of the mirror."""
    signs = np.concatenate([MIRROR[feature.name] for feature in FEATURES])
    mirrored = launch_features(to_device(mirror_sample(sample))).numpy()
    np.testing.assert_allclose(mirrored, features * signs, rtol=1e-4, atol=2e-5)


def test_contacts_with_the_wrong_part_do_not_count(sample: Sample) -> None:
    """Articulation looks at one part only, grasping at either."""
    force = np.zeros_like(sample.contact_force)
    force[..., 0, :] = [0.0, 0.0, 2.0]
    touching_base = replace(sample, contact_force=force, contacts=np.ones_like(sample.contacts))
    missing = slice(feature_slice("contact_goal").start + 16, feature_slice("contact_goal").stop)
    for contact_part, expected in ((0, 0.0), (1, 1.0), (-1, 0.0)):
        asked = replace(touching_base, contact_part=np.full_like(sample.contact_part, contact_part))
        assert (launch_features(to_device(asked)).numpy()[..., missing] == expected).all()


def test_forces_that_cancel_still_touch(sample: Sample) -> None:
    """A link pinched between both parts feels no net force, but is in contact with either."""
    force = np.zeros_like(sample.contact_force)
    force[..., 0, :], force[..., 1, :] = [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]
    pinched = replace(
        sample,
        contact_force=force,
        contacts=np.ones_like(sample.contacts),
        contact_part=np.full_like(sample.contact_part, -1),
    )
    features = launch_features(to_device(pinched)).numpy()
    assert (features[..., feature_slice("link_forces")] == 0.0).all()
    assert (features[..., feature_slice("contact_goal")][..., 16:] == 0.0).all()
