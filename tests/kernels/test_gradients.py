"""Gradients through `wp.Tape` against central differences of the double-precision NumPy reference."""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest
import warp as wp

from artigrasp.kernels.layout import DOF_COUNT, FINGER_DOF_COUNT, KEYPOINT_COUNT, LINK_COUNT
from artigrasp.kernels.rewards import TERMS
from artigrasp.kernels.torques import pd_torques
from tests.kernels import numpy_reference
from tests.kernels.launches import launch_features, launch_forward_kinematics, launch_rewards
from tests.kernels.samples import DeviceSample, Sample, random_sample, to_device

WORLD_COUNT = 20
STEP = 1e-6
Output = Callable[[Sample], np.ndarray]
INPUTS = ("joint_q", "joint_qd", "contact_force", "velocity", "hinge_q", "hinge_qd", "finger_angles", "angle")
"""Everything that is not a frame; frames are checked by their positions."""


def device_array(device: DeviceSample, name: str) -> wp.array:
    """The array of that name, whichever group has it."""
    groups = (device.hands, device.objects, device.goal)
    return next(getattr(group, name) for group in groups if hasattr(group, name))


def perturbed(sample: Sample, name: str, columns: int, step: float) -> Sample:
    """Copies of all worlds [columns * W], copy i with column i of one input, flattened per world, shifted."""
    copies = {
        field.name: np.concatenate([getattr(sample, field.name)] * columns)
        for field in fields(sample)
        if field.name not in ("link_offset", "tip_offset") and np.ndim(getattr(sample, field.name))
    }
    flat = copies[name].reshape(columns, sample.world_count, -1)
    flat[np.arange(columns), :, np.arange(columns)] += step
    return replace(sample, **copies)


def differences(output: Output, sample: Sample, weight: np.ndarray, name: str, columns: int) -> np.ndarray:
    """Central differences [W, columns] of the weighted sum of an output [W, ...] of each world."""
    change = output(perturbed(sample, name, columns, STEP)) - output(perturbed(sample, name, columns, -STEP))
    change = change.reshape(columns, sample.world_count, -1)
    return np.einsum("cwi,wi->wc", change, weight.reshape(sample.world_count, -1)) / (2.0 * STEP)


def assert_gradients_agree(
    device: DeviceSample, sample: Sample, output: Output, weight: np.ndarray, names: tuple[str, ...]
) -> None:
    """The gradients that the tape left agree with differences of the reference output, for every named input."""
    for name in names:
        gradient = device_array(device, name).grad.numpy().reshape(sample.world_count, -1)
        # Frames differ by their rotation numbers, which are not independent: their positions only.
        columns = 3 if name in ("pose", "start_object_pose") else gradient.shape[1]
        expected = differences(output, sample, weight, name, columns)
        scale = np.abs(expected).max()
        assert scale > 1e-3, f"{name} does not matter"
        np.testing.assert_allclose(gradient[:, :columns], expected, rtol=2e-3, atol=2e-4 * scale, err_msg=name)


@pytest.fixture(scope="module")
def sample() -> Sample:
    """20 random states in which every hand takes part."""
    sample = random_sample(WORLD_COUNT, seed=1)
    return replace(sample, active=np.ones_like(sample.active))


def test_forward_kinematics(sample: Sample) -> None:
    """Keypoints with respect to the joint coordinates."""
    weight = np.random.default_rng(0).normal(size=(WORLD_COUNT, 2, KEYPOINT_COUNT, 3))
    device = to_device(sample, requires_grad=True)
    with wp.Tape() as tape:
        launch_forward_kinematics(device)
    tape.backward(grads={device.hands.keypoint: wp.array(weight, dtype=wp.vec3)})

    def keypoints(changed: Sample) -> np.ndarray:
        return numpy_reference.forward_kinematics(changed)[1]

    assert_gradients_agree(device, sample, keypoints, weight, ("joint_q",))


def test_features(sample: Sample) -> None:
    """All features with respect to joints, object, forces and goals."""
    device = to_device(sample, requires_grad=True)
    with wp.Tape() as tape:
        features = launch_features(device)
    weight = np.random.default_rng(0).normal(size=features.shape)
    tape.backward(grads={features: wp.array(weight, dtype=float)})
    assert_gradients_agree(device, sample, numpy_reference.features, weight, (*INPUTS, "pose"))


def test_rewards(sample: Sample) -> None:
    """The total reward with respect to joints, object, forces and goals."""
    device = to_device(sample, requires_grad=True)
    with wp.Tape() as tape:
        _, total = launch_rewards(device, sample)
    tape.backward(grads={total: wp.full(total.shape, 1.0, dtype=float)})

    def reward(changed: Sample) -> np.ndarray:
        return sum(numpy_reference.reward_terms(changed, changed.part_mass[:, 1]).values())

    assert_gradients_agree(device, sample, reward, np.ones(total.shape), (*INPUTS, "pose", "start_object_pose"))


@pytest.mark.parametrize("name", TERMS)
def test_reward_term(sample: Sample, name: str) -> None:
    """Each term alone with respect to the joint coordinates, so that a small term is not hidden by a large one."""
    device = to_device(sample, requires_grad=True)
    with wp.Tape() as tape:
        terms, _ = launch_rewards(device, sample)
    weight = np.zeros(terms.shape)
    weight[..., TERMS.index(name)] = 1.0
    tape.backward(grads={terms: wp.array(weight, dtype=float)})

    def term(changed: Sample) -> np.ndarray:
        return numpy_reference.reward_terms(changed, changed.part_mass[:, 1])[name]

    if name in ("keypoint", "pose"):
        assert_gradients_agree(device, sample, term, np.ones(terms.shape[:2]), ("joint_q", "hinge_q"))
    elif name == "hand_velocity":
        assert_gradients_agree(device, sample, term, np.ones(terms.shape[:2]), ("joint_q", "joint_qd"))
    else:
        assert (device.hands.joint_q.grad.numpy() == 0.0).all()


def test_torques() -> None:
    """Torques with respect to targets, coordinates and rates: the gains, or nothing at the effort limit."""
    rng = np.random.default_rng(0)
    shape = (WORLD_COUNT, 2, DOF_COUNT)
    target, joint_q, joint_qd = (wp.array(rng.normal(size=shape), dtype=float, requires_grad=True) for _ in range(3))
    stiffness, damping = (wp.array(rng.uniform(1.0, 9.0, (WORLD_COUNT, 2, 3)), dtype=float) for _ in range(2))
    effort = wp.full((2, DOF_COUNT), 10.0, dtype=float)
    torque = wp.zeros(shape, dtype=float, requires_grad=True)
    with wp.Tape() as tape:
        wp.launch(
            pd_torques,
            dim=shape[:2],
            inputs=[target, joint_q, joint_qd, stiffness, damping, effort],
            outputs=[torque],
        )
    tape.backward(grads={torque: wp.full(shape, 1.0, dtype=float)})
    free = np.abs(torque.numpy()) < 10.0
    assert 0.1 < free.mean() < 0.9
    group = np.minimum(np.arange(DOF_COUNT) // 3, 2)
    np.testing.assert_allclose(target.grad.numpy(), stiffness.numpy()[..., group] * free, rtol=1e-6)
    np.testing.assert_allclose(joint_q.grad.numpy(), -stiffness.numpy()[..., group] * free, rtol=1e-6)
    np.testing.assert_allclose(joint_qd.grad.numpy(), -damping.numpy()[..., group] * free, rtol=1e-6)


def degenerate(sample: Sample) -> Sample:
    """Every norm at zero: at rest in the reference, the wrist on the hinge axis, no contact and none wanted."""
    frames = np.zeros((WORLD_COUNT, 2, 7))
    frames[..., 6] = 1.0
    still = replace(
        sample,
        joint_q=np.zeros_like(sample.joint_q),
        joint_qd=np.zeros_like(sample.joint_qd),
        finger_angles=np.zeros_like(sample.finger_angles),
        hand_base=frames,
        wrist_pose_in_part=frames,
        pose=frames[:, 0],
        start_object_pose=frames[:, 0],
        velocity=np.zeros_like(sample.velocity),
        hinge_q=np.zeros_like(sample.hinge_q),
        hinge_qd=np.zeros_like(sample.hinge_qd),
        angle=np.zeros_like(sample.angle),
        hinge_origin=np.zeros_like(sample.hinge_origin),
        contact_force=np.zeros_like(sample.contact_force),
        contacts=np.zeros((WORLD_COUNT, 2, LINK_COUNT)),
    )
    return replace(still, keypoint_in_part=numpy_reference.forward_kinematics(still)[1])


def test_values_and_gradients_stay_finite_where_norms_vanish(sample: Sample) -> None:
    """Zero distance, zero error, zero force and no target contact give finite features, rewards and gradients."""
    still = degenerate(sample)
    for launch in (launch_features, lambda device: launch_rewards(device, still)[1]):
        device = to_device(still, requires_grad=True)
        with wp.Tape() as tape:
            output = launch(device)
        assert np.isfinite(output.numpy()).all()
        tape.backward(grads={output: wp.full(output.shape, 1.0, dtype=float)})
        for name in (*INPUTS, "pose", "hand_base", "wrist_pose_in_part"):
            assert np.isfinite(device_array(device, name).grad.numpy()).all(), name


def test_references_without_contacts_have_finite_gradients(sample: Sample) -> None:
    """Whatever the links touch, a goal without contacts passes no gradient to the forces."""
    without = replace(sample, contacts=np.zeros_like(sample.contacts))
    device = to_device(without, requires_grad=True)
    with wp.Tape() as tape:
        _, total = launch_rewards(device, without)
    tape.backward(grads={total: wp.full(total.shape, 1.0, dtype=float)})
    assert (device.hands.contact_force.grad.numpy() == 0.0).all()
    assert np.isfinite(device.hands.joint_q.grad.numpy()).all()
    assert device.goal.finger_angles.grad.shape == (WORLD_COUNT, 2, FINGER_DOF_COUNT)
