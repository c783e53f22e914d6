"""Gradients through the differentiable rollout, against finite differences of the rollout itself."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from artigrasp.config.checks import FieldError
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOFS, KEYPOINTS, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import pose_parts_in_base
from artigrasp.references.poses import compose_poses
from artigrasp.references.quality import wrist_in_base
from artigrasp.references.reference import load_references
from artigrasp.simulation.differentiable import DifferentiableRollout, SpringContacts
from tests.simulation.scenes import open_scene

SCENE = open_scene(fixed_base=True)
RIGHT = 1
PROBED = [0, 1, 2, 5, DOFS.index("index1_rz")]
"""Coordinates whose targets are shifted, each in a pair of worlds after the first world."""
WORLDS = 1 + 2 * (len(PROBED) + 1)


def rollout(away: float, step: float, control_steps: int = 1) -> DifferentiableRollout:
    """A hand at a shipped reference, or away from it along x [m]; inputs are shifted by a step in pairs of worlds.

    The last pair is shifted in the initial rate of the hinge.
    """
    reference = load_references("lidded-box").select(split="train", indices=0)
    result = DifferentiableRollout(SCENE, WORLDS, control_steps, timestep=1e-3)
    wrist = wrist_in_base(reference, pose_parts_in_base(SCENE.objects[0], reference.object_angle))[:, RIGHT:]
    base = compose_poses(reference.object_pose[:, None], wrist) + [away, 0, 0, 0, 0, 0, 0]  # noqa: RUF005
    result.place(np.repeat(base, WORLDS, axis=0), np.repeat(reference.object_pose[:, None], WORLDS, axis=0))
    joint_q = np.zeros(result.joint_q.shape, np.float32)
    joint_q[..., WRIST_DOF_COUNT:] = reference.finger_angles[0, RIGHT]
    result.joint_q.assign(joint_q)
    for pair, dof in enumerate(PROBED):
        joint_q[1 + 2 * pair, 0, dof] += step
        joint_q[2 + 2 * pair, 0, dof] -= step
    for target in result.targets:
        target.assign(joint_q)
    rates = np.zeros((WORLDS, 1), np.float32)
    rates[-2:, 0] = [step, -step]
    result.hinge_qd.assign(rates)
    result.run()
    return result


def differences(values: np.ndarray, step: float) -> np.ndarray:
    """Central differences of an output of every world [W]."""
    return (values[1::2] - values[2::2]).astype(np.float64) / (2 * step)


def gradient(result: DifferentiableRollout) -> np.ndarray:
    """By the targets that are probed and by the hinge's rate, of the first world."""
    by_targets = np.sum([target.grad.numpy()[0, 0, PROBED] for target in result.targets], axis=0)
    return np.append(by_targets, result.hinge_qd.grad.numpy()[0, 0])


def test_free_motion() -> None:
    """Far from the object a fingertip follows its targets, and the gradient says by how much."""
    step, tip = 0.02, KEYPOINTS.index("index_tip")
    result = rollout(1.0, step)
    assert result.contact_count() == 0
    direction = np.array([0.5, -0.3, 0.8])
    seed = np.zeros((*result.hands.keypoint.shape, 3), np.float32)
    seed[0, 0, tip] = direction
    result.backward({result.hands.keypoint: wp.array(seed, dtype=wp.vec3)})
    expected = differences(result.hands.keypoint.numpy()[:, 0, tip] @ direction, step)
    assert np.abs(expected[:-1]).min() > 1e-4
    np.testing.assert_allclose(gradient(result), expected, rtol=2e-2, atol=1e-2 * np.abs(expected).max())


def test_contact() -> None:
    """In contact with the lid, the hinge's angle depends on the hand's targets through the contacts."""
    step = 1e-3
    result = rollout(0.0, step, control_steps=2)
    assert result.contact_count() > WORLDS
    seed = np.zeros((WORLDS, 1), np.float32)
    seed[0] = 1.0
    result.backward({result.hinge_angles[-1]: wp.array(seed, dtype=float)})
    angles = result.hinge_angles[-1].numpy()[:, 0]
    assert angles[0] > 1e-3
    expected, found = differences(angles, step), gradient(result)
    # Of the targets and of the rate apart, for the latter is by far the larger.
    np.testing.assert_allclose(found[-1], expected[-1], rtol=0.1)
    error = np.linalg.norm(found[:-1] - expected[:-1]) / np.linalg.norm(expected[:-1])
    assert error < 0.1, (found, expected)
    # A second run and gradient are the same: nothing of the first is left over.
    result.run()
    result.backward({result.hinge_angles[-1]: wp.array(seed, dtype=float)})
    np.testing.assert_allclose(gradient(result), found, rtol=1e-4)


def test_hands_are_weightless_and_the_lid_is_not() -> None:
    """With no targets off and nothing near, the hand stays; a lid that is held open falls."""
    result = rollout(1.0, 0.0)
    np.testing.assert_allclose(result.hands.joint_q.numpy(), result.joint_q.numpy(), atol=1e-5)
    result.hinge_q.fill_(0.5)
    result.run()
    assert (result.hinge_angles[-1].numpy() < 0.5 - 1e-4).all()
    assert (result.hinge_rates[-1].numpy() < -1e-2).all()


def test_what_cannot_be_simulated() -> None:
    """Free bases and contacts without stiffness are refused."""
    with pytest.raises(UserError, match="fixed_base: expected an object with a fixed base"):
        DifferentiableRollout(replace(SCENE, fixed_base=False), 1, 1)
    with pytest.raises(FieldError, match="stiffness: expected a positive number, found 0"):
        SpringContacts(stiffness=0.0)
