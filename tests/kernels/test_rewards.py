"""The reward terms against an independent NumPy reference."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.kernels.rewards import TERMS
from tests.kernels import numpy_reference
from tests.kernels.launches import launch_rewards
from tests.kernels.samples import Sample, mirror_sample, random_sample, to_device


@pytest.fixture(scope="module")
def sample() -> Sample:
    """100 random states."""
    return random_sample()


@pytest.fixture(scope="module")
def rewards(sample: Sample) -> tuple[np.ndarray, np.ndarray]:
    """Their terms [W, H, 8] and totals [W, H]."""
    terms, total = launch_rewards(to_device(sample), sample)
    return terms.numpy(), total.numpy()


@pytest.mark.parametrize("name", TERMS)
def test_term_agrees_with_numpy(sample: Sample, rewards: tuple[np.ndarray, np.ndarray], name: str) -> None:
    """One term, on every random state, and it is not trivially zero."""
    expected = numpy_reference.reward_terms(sample, sample.part_mass[:, 1])[name]
    assert np.count_nonzero(expected) > 50
    np.testing.assert_allclose(rewards[0][..., TERMS.index(name)], expected, rtol=1e-4, atol=2e-5)


def test_force_term_meets_its_cap_on_some_states_only(sample: Sample) -> None:
    """The random states exercise both sides of the minimum."""
    force = numpy_reference.reward_terms(sample, sample.part_mass[:, 1])["force"]
    cap = numpy_reference.WEIGHTS["force"] * numpy_reference.WEIGHTS["force_cap"] * sample.part_mass[:, 1:]
    capped = np.isclose(force, cap)
    assert 10 < capped.sum() < (force > 0).sum() - 10


def test_total_is_the_sum_and_idle_hands_get_nothing(sample: Sample, rewards: tuple[np.ndarray, np.ndarray]) -> None:
    """Every term counts once; a hand that takes no part is neither rewarded nor punished."""
    terms, total = rewards
    np.testing.assert_allclose(total, terms.sum(-1), rtol=1e-5)
    assert (sample.active == 0).any()
    assert (terms[sample.active == 0] == 0.0).all()
    assert (total[sample.active == 0] == 0.0).all()


def test_a_reference_without_contacts_gives_no_contact_reward(
    sample: Sample, rewards: tuple[np.ndarray, np.ndarray]
) -> None:
    """No target contact means zero for both contact terms, not a division by zero."""
    without = (sample.contacts.sum(-1) == 0) & (sample.active == 1)
    assert without.sum() > 10
    contact = [TERMS.index("contact"), TERMS.index("force")]
    assert (rewards[0][without][:, contact] == 0.0).all()
    assert np.isfinite(rewards[1]).all()


def test_rewards_are_the_same_in_a_mirror(sample: Sample, rewards: tuple[np.ndarray, np.ndarray]) -> None:
    """A left hand earns what a right hand earns for the mirrored deed."""
    mirrored = mirror_sample(sample)
    terms, _ = launch_rewards(to_device(mirrored), mirrored)
    np.testing.assert_allclose(terms.numpy(), rewards[0], rtol=1e-4, atol=2e-5)


def test_reward_is_best_at_the_goal() -> None:
    """At rest in the reference, with all contacts, every penalty is zero."""
    sample = random_sample(8, seed=3)
    still = replace(
        sample,
        joint_qd=np.zeros_like(sample.joint_qd),
        velocity=np.zeros_like(sample.velocity),
        hinge_qd=np.zeros_like(sample.hinge_qd),
        angle=sample.hinge_q,
        finger_angles=sample.joint_q[..., 6:],
        start_object_pose=sample.pose,
        contacts=np.ones_like(sample.contacts),
        contact_force=np.ones_like(sample.contact_force),
        active=np.ones_like(sample.active),
    )
    wrist, _ = numpy_reference.forward_kinematics(still)
    matrix, position = numpy_reference.compose(numpy_reference.inverse(numpy_reference.part_frame(still)), wrist[0])
    quaternion = numpy_reference.Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_quat().reshape(*matrix.shape[:2], 4)
    still = replace(
        still,
        wrist_pose_in_part=np.concatenate([position, quaternion], axis=-1),
        keypoint_in_part=still.keypoint_in_part - numpy_reference.keypoint_errors(still),
    )
    terms = launch_rewards(to_device(still), still)[0].numpy()
    penalties = [TERMS.index(name) for name in TERMS if name not in ("contact", "force")]
    np.testing.assert_allclose(terms[..., penalties], 0.0, atol=1e-5)
    np.testing.assert_allclose(terms[..., TERMS.index("contact")], numpy_reference.WEIGHTS["contact"])
