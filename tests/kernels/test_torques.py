"""PD torques."""

import numpy as np
import warp as wp

from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.kernels.torques import pd_torques


def test_torques_agree_with_numpy_and_stop_at_the_effort() -> None:
    """Gains per group of DoFs and world, effort per hand and DoF."""
    rng = np.random.default_rng(0)
    shape = (7, 2, DOF_COUNT)
    target, joint_q, joint_qd = (rng.normal(size=shape).astype(np.float32) for _ in range(3))
    stiffness, damping = (rng.uniform(1.0, 50.0, (7, 2, 3)).astype(np.float32) for _ in range(2))
    effort = rng.uniform(5.0, 50.0, (2, DOF_COUNT)).astype(np.float32)
    torque = wp.zeros(shape, dtype=float)
    wp.launch(
        pd_torques,
        dim=shape[:2],
        inputs=[wp.array(array, dtype=float) for array in (target, joint_q, joint_qd, stiffness, damping, effort)],
        outputs=[torque],
    )
    group = np.array([0] * 3 + [1] * 3 + [2] * 45)
    unlimited = stiffness[..., group] * (target - joint_q) - damping[..., group] * joint_qd
    np.testing.assert_allclose(torque.numpy(), np.clip(unlimited, -effort, effort), rtol=1e-5, atol=1e-4)
    assert 0.1 < (np.abs(unlimited) > effort).mean() < 0.9
