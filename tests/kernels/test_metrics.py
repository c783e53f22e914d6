"""Measurements of an episode."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.kernels.metrics import (
    DIVERGED,
    FAILURES,
    LOST_OBJECT,
    NOT_FINITE,
    OVERFLOW,
    RUNAWAY,
    EpisodeMetrics,
    FailureLimits,
    episode_metrics,
    reset_metrics,
    update_metrics,
)
from artigrasp.kernels.states import element_types
from tests.kernels.samples import Sample, random_sample, to_device

WORLD_COUNT = 12


def limits() -> FailureLimits:
    """Thresholds of the tests."""
    result = FailureLimits()
    result.speed = 100.0
    result.coordinate = 10.0
    result.displacement = 2.0
    return result


def measure(
    metrics: EpisodeMetrics,
    *samples: Sample,
    diverged: np.ndarray | None = None,
    overflow: np.ndarray | None = None,
    failure_count: wp.array | None = None,
) -> dict[str, np.ndarray]:
    """Take in states one after the other; returns the measurements."""
    flags = [wp.array(np.zeros(WORLD_COUNT) if each is None else each, dtype=int) for each in (diverged, overflow)]
    counts = wp.zeros(len(FAILURES), dtype=int) if failure_count is None else failure_count
    for sample in samples:
        device = to_device(sample)
        wp.launch(
            update_metrics,
            dim=WORLD_COUNT,
            inputs=[device.hands, device.objects, device.goal, *flags, limits(), metrics, counts],
        )
    return {name: getattr(metrics, name).numpy().copy() for name in element_types(EpisodeMetrics)}


@pytest.fixture
def trajectory() -> list[Sample]:
    """Ten states of twelve worlds."""
    start = random_sample(WORLD_COUNT, seed=5)
    rng = np.random.default_rng(0)
    steps = [random_sample(WORLD_COUNT, seed=seed) for seed in range(10)]
    return [
        replace(
            step,
            start_object_pose=start.start_object_pose,
            start_angle=start.start_angle,
            target_angle=start.target_angle,
            target_object_pose=start.target_object_pose,
            hinge_q=rng.uniform(-0.35, 0.35, WORLD_COUNT),
        )
        for step in steps
    ]


def test_measurements_agree_with_numpy(trajectory: list[Sample]) -> None:
    """Present, largest and mean values over ten steps."""
    result = measure(episode_metrics(WORLD_COUNT), *trajectory)
    start = trajectory[0].start_object_pose
    displacement = np.stack([np.linalg.norm(step.pose[:, :3] - start[:, :3], axis=-1) for step in trajectory])
    up = np.array([0.0, 0.0, 1.0])
    carried = Rotation.from_quat(start[:, 3:]).inv().apply(up)
    tilt = np.stack([np.arccos(Rotation.from_quat(step.pose[:, 3:]).apply(carried)[:, 2]) for step in trajectory])
    change = np.stack([np.abs(step.hinge_q - step.start_angle) for step in trajectory])
    target = trajectory[0].target_object_pose
    away = np.stack([np.linalg.norm(step.pose[:, :3] - target[:, :3], axis=-1) for step in trajectory])
    turned, off = (np.stack([angle_between(step.pose, to) for step in trajectory]) for to in (start, target))
    error = np.stack([np.abs(step.hinge_q - step.target_angle) for step in trajectory])
    np.testing.assert_allclose(result["displacement"], displacement[-1], atol=1e-4)
    for name, values in {"displacement": displacement, "tilt": tilt, "angle_change": change}.items():
        np.testing.assert_allclose(result[f"{name}_max"], values.max(0), atol=1e-4)
    for name, values in {"position_error": away, "rotation_error": off, "angle_error": error}.items():
        np.testing.assert_allclose(result[name], values[-1], atol=1e-4)
        least = np.minimum(values.min(0), 0.0)  # zeroed metrics begin with the least error there is
        np.testing.assert_allclose(result[f"{name}_min"], least, atol=1e-4)
    np.testing.assert_allclose(result["turn"], turned[-1], atol=1e-4)
    np.testing.assert_allclose(result["lift"], trajectory[-1].pose[:, 2] - start[:, 2], atol=1e-5)
    np.testing.assert_array_equal(result["angle"], trajectory[-1].hinge_q.astype(np.float32))
    np.testing.assert_allclose(result["displacement_mean"], displacement.mean(0), rtol=1e-5)
    np.testing.assert_allclose(result["angle_error"], error[-1], rtol=1e-4)
    np.testing.assert_allclose(result["angle_error_mean"], error.mean(0), rtol=1e-5)
    assert (result["step_count"] == 10).all()
    assert (result["failure"] == 0).all()


def test_turning_on_the_spot_is_no_tilt(trajectory: list[Sample]) -> None:
    """Yaw about the vertical leaves the tilt at zero; a quarter turn to the side does not."""
    for axis, expected in (([0.0, 0.0, 1.0], 0.0), ([0.6, 0.8, 0.0], 1.2)):
        pose = trajectory[0].start_object_pose.copy()
        pose[:, 3:] = (Rotation.from_rotvec(1.2 * np.array(axis)) * Rotation.from_quat(pose[:, 3:])).as_quat()
        result = measure(episode_metrics(WORLD_COUNT), replace(trajectory[0], pose=pose))
        np.testing.assert_allclose(result["tilt_max"], expected, atol=1e-5)


def test_masked_reset(trajectory: list[Sample]) -> None:
    """Only the masked worlds forget their episode; the hinge then counts as measured at its start."""
    metrics = episode_metrics(WORLD_COUNT)
    before = measure(metrics, *trajectory)
    mask = np.arange(WORLD_COUNT) % 2
    goal = to_device(trajectory[0]).goal
    wp.launch(reset_metrics, dim=WORLD_COUNT, inputs=[wp.array(mask, dtype=int), goal, metrics])
    start, error = goal.start_angle.numpy(), np.abs(goal.target_angle.numpy() - goal.start_angle.numpy())
    sample = trajectory[0]
    away = np.linalg.norm(sample.start_object_pose[:, :3] - sample.target_object_pose[:, :3], axis=-1)
    off = angle_between(sample.start_object_pose, sample.target_object_pose)
    fresh = {"angle": start, "angle_error": error, "angle_error_mean": error, "angle_error_min": error}
    fresh |= {name + suffix: values for name, values in (("position_error", away), ("rotation_error", off))
              for suffix in ("", "_min")}  # fmt: skip
    fresh["position_error_mean"] = away
    for name, values in before.items():
        expected = np.where(mask == 1, fresh.get(name, 0), values)
        np.testing.assert_allclose(getattr(metrics, name).numpy(), expected, atol=1e-5)


def test_the_least_errors_are_kept(trajectory: list[Sample]) -> None:
    """From a reset on, the smallest error of any step remains, whatever comes later; the mean is of all steps."""
    metrics = episode_metrics(WORLD_COUNT)
    everywhere = wp.full(WORLD_COUNT, 1, dtype=int)
    wp.launch(reset_metrics, dim=WORLD_COUNT, inputs=[everywhere, to_device(trajectory[0]).goal, metrics])
    result = measure(metrics, *trajectory)
    target = trajectory[0].target_object_pose
    poses = [trajectory[0].start_object_pose, *(step.pose for step in trajectory)]
    away = np.stack([np.linalg.norm(pose[:, :3] - target[:, :3], axis=-1) for pose in poses])
    np.testing.assert_allclose(result["position_error_min"], away.min(0), atol=1e-5)
    np.testing.assert_allclose(result["position_error_mean"], away[1:].mean(0), atol=1e-5)
    np.testing.assert_allclose(
        result["rotation_error_min"], np.min([angle_between(p, target) for p in poses], 0), atol=1e-4
    )
    angles = [trajectory[0].start_angle, *(step.hinge_q for step in trajectory)]
    least = np.min([np.abs(angle - trajectory[0].target_angle) for angle in angles], 0)
    np.testing.assert_allclose(result["angle_error_min"], least, atol=1e-5)
    assert (result["position_error_min"] < result["position_error"]).any()


def angle_between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angles [W] of the shortest turns between poses [W, 7]."""
    return (Rotation.from_quat(first[:, 3:]).inv() * Rotation.from_quat(second[:, 3:])).magnitude()


def test_nothing_is_measured_after_a_failure(trajectory: list[Sample]) -> None:
    """What a world shows once its physics gave up, or lost contacts, is no measurement, to the end of the episode."""
    metrics = episode_metrics(WORLD_COUNT)
    before = measure(metrics, *trajectory[:2])
    diverged, overflow = (np.arange(WORLD_COUNT) == world for world in (3, 5))
    measure(metrics, trajectory[2], diverged=diverged, overflow=overflow)
    result = measure(metrics, trajectory[3])
    np.testing.assert_array_equal(result["failure"], DIVERGED * diverged + OVERFLOW * overflow)
    for world in (3, 5):
        assert all((values[world] == before[name][world]).all() for name, values in result.items() if name != "failure")
    np.testing.assert_array_equal(result["step_count"], np.where(diverged | overflow, 2, 4))


def test_failures_are_counted_once_per_episode(trajectory: list[Sample]) -> None:
    """However long a failure lasts, and anew in the next episode; a world may fail in several ways."""
    metrics, counts = episode_metrics(WORLD_COUNT), wp.zeros(len(FAILURES), dtype=int)
    lost = trajectory[1].pose.copy()
    lost[[3, 6], 0] += 10.0
    failing = replace(trajectory[1], pose=lost)
    diverged = np.arange(WORLD_COUNT) == 3
    mask = wp.array(np.arange(WORLD_COUNT) == 6, dtype=int)
    for expected in (2, 3):
        measure(metrics, failing, failing, diverged=diverged, overflow=2 * diverged, failure_count=counts)
        found = dict(zip(FAILURES, counts.numpy().tolist(), strict=True))
        assert found == {"not_finite": 0, "runaway": 0, "lost_object": expected, "diverged": 1, "overflow": 1}
        wp.launch(reset_metrics, dim=WORLD_COUNT, inputs=[mask, to_device(failing).goal, metrics])


@pytest.mark.parametrize("name", ["joint_q", "joint_qd", "pose", "velocity", "hinge_q", "hinge_qd"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite(trajectory: list[Sample], name: str, value: float) -> None:
    """Any such number of a state flags its world, and its world only, and spoils no measurement."""
    broken = getattr(trajectory[1], name).copy()
    broken.reshape(WORLD_COUNT, -1)[3, -1] = value
    metrics = episode_metrics(WORLD_COUNT)
    result = measure(metrics, trajectory[0], replace(trajectory[1], **{name: broken}), trajectory[2])
    flagged = (result["failure"] & NOT_FINITE) != 0
    np.testing.assert_array_equal(flagged, np.arange(WORLD_COUNT) == 3)
    assert all(np.isfinite(values).all() for values in result.values())
    np.testing.assert_array_equal(result["step_count"], np.where(flagged, 1, 3))


def test_runaway_and_lost_objects(trajectory: list[Sample]) -> None:
    """Too fast a joint, hinge or object, too far a joint, and an object too far from its start, flagged for good."""
    fast, spinning, pose = trajectory[1].joint_qd.copy(), trajectory[1].hinge_qd.copy(), trajectory[1].pose.copy()
    fast[2, 1, 50] = -101.0
    spinning[4] = 101.0
    pose[6, 0] += 10.0
    far, velocity = trajectory[1].joint_q.copy(), trajectory[1].velocity.copy()
    far[7, 0, 20] = -11.0
    velocity[8, 0], velocity[9, 5] = 101.0, -101.0
    metrics = episode_metrics(WORLD_COUNT)
    failing = replace(trajectory[1], joint_qd=fast, hinge_qd=spinning, pose=pose, joint_q=far, velocity=velocity)
    failure = measure(metrics, trajectory[0], failing, trajectory[2])["failure"]
    expected = np.zeros(WORLD_COUNT, int)
    expected[[2, 4, 7, 8, 9]] = RUNAWAY
    expected[6] = LOST_OBJECT
    np.testing.assert_array_equal(failure, expected)
