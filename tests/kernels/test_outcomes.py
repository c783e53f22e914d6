"""Reward of the outcome."""

from dataclasses import replace

import numpy as np
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.kernels.outcomes import OUTCOME_TERMS, add_outcome_reward
from tests.kernels.samples import Sample, random_sample, to_device

WORLD_COUNT = 50
EPISODE_STEPS, OPENED_ANGLE = 300, 0.3
WEIGHTS = (2.0, 0.5, 3.0, 4.0, 5.0, 0.7, 0.9)
LIFTED_HEIGHT = 0.1
OTHER_REWARDS = -7.0


def outcome_reward(sample: Sample, step: int) -> tuple[np.ndarray, np.ndarray]:
    """[W, H, 7] terms after a number of steps, and the [W, H] total to which they were added."""
    device = to_device(sample)
    terms = wp.full((WORLD_COUNT, 2, len(OUTCOME_TERMS)), np.nan, dtype=float)
    total = wp.full((WORLD_COUNT, 2), OTHER_REWARDS, dtype=float)
    steps = wp.full(WORLD_COUNT, step, dtype=int)
    wp.launch(
        add_outcome_reward,
        dim=(WORLD_COUNT, 2),
        inputs=[
            device.objects,
            device.goal,
            steps,
            EPISODE_STEPS,
            OPENED_ANGLE,
            LIFTED_HEIGHT,
            wp.array(WEIGHTS, dtype=float),
        ],
        outputs=[terms, total],
    )
    return terms.numpy(), total.numpy()


def test_outcome_is_rewarded_at_the_end() -> None:
    """Error and success count in the last step only, mean error and displacement in all; idle hands earn nothing."""
    sample = replace(random_sample(WORLD_COUNT), start_angle=np.linspace(0.0, 1.0, WORLD_COUNT))
    error = np.abs(sample.angle - sample.hinge_q)[:, None] * sample.active
    opened = (np.abs(sample.hinge_q - sample.start_angle) > OPENED_ANGLE)[:, None] * sample.active
    lifted = (sample.pose[:, 2] - sample.start_object_pose[:, 2] > LIFTED_HEIGHT)[:, None] * sample.active
    distance = np.linalg.norm(sample.pose[:, :3] - sample.target_object_pose[:, :3], axis=1)
    target = Rotation.from_quat(sample.target_object_pose[:, 3:])
    turn = (Rotation.from_quat(sample.pose[:, 3:]) * target.inv()).magnitude()
    missed, turned = (np.minimum(each, 0.5)[:, None] * sample.active for each in (distance, turn))
    assert 0 < lifted.sum() < sample.active.sum() and (distance < 0.5).any() and (distance > 0.5).any()
    displacement = np.linalg.norm(sample.pose[:, :3] - sample.start_object_pose[:, :3], axis=1)
    moved = displacement[:, None] * sample.active
    assert 0 < opened.sum() < sample.active.sum() < sample.active.size
    for step, last in [(1, 0.0), (EPISODE_STEPS - 1, 0.0), (EPISODE_STEPS, 1.0)]:
        terms, total = outcome_reward(sample, step)
        expected = [-WEIGHTS[0] * error * last, -WEIGHTS[1] * error / EPISODE_STEPS, WEIGHTS[2] * opened * last]
        expected += [-WEIGHTS[3] * moved / EPISODE_STEPS, WEIGHTS[4] * lifted * last]
        expected += [-WEIGHTS[5] * missed * last, -WEIGHTS[6] * turned * last]
        np.testing.assert_allclose(terms, np.stack(expected, axis=-1), atol=1e-5)
        np.testing.assert_allclose(total, OTHER_REWARDS + terms.sum(axis=-1), atol=1e-5)
