"""Kernels launched on samples, as functions of arrays."""

import numpy as np
import warp as wp

from artigrasp.kernels.features import compute_features
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.layout import FEATURE_COUNT
from artigrasp.kernels.rewards import TERMS, RewardWeights, compute_rewards
from tests.kernels.numpy_reference import WEIGHTS
from tests.kernels.samples import DeviceSample, Sample


def reward_weights() -> RewardWeights:
    """The reference's weights."""
    weights = RewardWeights()
    for name, value in WEIGHTS.items():
        setattr(weights, name, value)
    return weights


def launch_forward_kinematics(device: DeviceSample) -> None:
    """Fill ``link_pose`` and ``keypoint``."""
    wp.launch(forward_kinematics, dim=device.goal.part.shape, inputs=[device.hands, device.hand_model])


def launch_features(device: DeviceSample, with_hinge: bool = True) -> wp.array:
    """[W, H, 279], forward kinematics included."""
    launch_forward_kinematics(device)
    shape = device.goal.part.shape
    features = wp.full((*shape, FEATURE_COUNT), np.nan, dtype=float, requires_grad=device.hands.joint_q.requires_grad)
    wp.launch(
        compute_features,
        dim=shape,
        inputs=[device.hands, device.objects, device.object_model, device.goal, int(with_hinge)],
        outputs=[features],
    )
    return features


def launch_rewards(device: DeviceSample, sample: Sample) -> tuple[wp.array, wp.array]:
    """[W, H, 8] terms and [W, H] total; the force cap takes the articulated part's mass."""
    launch_forward_kinematics(device)
    shape = device.goal.part.shape
    requires_grad = device.hands.joint_q.requires_grad
    terms = wp.full((*shape, len(TERMS)), np.nan, dtype=float, requires_grad=requires_grad)
    total = wp.full(shape, np.nan, dtype=float, requires_grad=requires_grad)
    mass = wp.array(sample.part_mass[:, 1], dtype=float)
    wp.launch(
        compute_rewards,
        dim=shape,
        inputs=[device.hands, device.objects, device.object_model, device.goal, reward_weights(), mass],
        outputs=[terms, total],
    )
    return terms, total
