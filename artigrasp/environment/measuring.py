"""What is measured of every episode, and how often physics failed."""

from collections.abc import Mapping

import numpy as np
import warp as wp

from artigrasp.arrays import Array
from artigrasp.environment import tables
from artigrasp.environment.world_range import WorldRange
from artigrasp.kernels import metrics, states
from artigrasp.simulation.launches import record

OPENED_ANGLE = 0.3
"""Change of the hinge angle that counts as articulated [rad] (paper, Metrics)."""

LIFTED_HEIGHT = 0.1
"""Height over its start of an object that counts as lifted [m] (paper, Metrics)."""

REACHED_DISTANCE, REACHED_TURN = 0.05, 0.2
"""Distance [m] and angle [rad] of a target that counts as reached (paper, Metrics, Task Success Rate)."""


def describe_failures(counts: Mapping[str, int]) -> str:
    """Counts by :meth:`Measuring.failure_counts` in words; empty if nothing failed."""
    found = [f"{name} {count}" for name, count in counts.items() if count]
    return f"failed physics: {', '.join(found)}" if found else ""


class Measuring:
    """Measures the episodes of all worlds.

    Attributes:
        metrics: What was measured since the resets.
    """

    def __init__(self, world_count: int, range_count: int, opens: bool, device: str) -> None:
        """Allocate.

        Args:
            world_count: Number of worlds.
            range_count: Ranges of worlds that threads of their own measure.
            opens: Whether an episode succeeds that opens the object, or else one that lifts it.
            device: Warp device.
        """
        self._device, self._opens = device, opens
        self.metrics = metrics.episode_metrics(world_count, device)
        self._limits = tables.failure_limits()
        self._failure_count = wp.zeros((range_count, len(metrics.FAILURES)), dtype=int, device=device)

    def reset(self, world_mask: wp.array, goal: states.Goal) -> None:
        """Begin anew in the worlds whose mask (int, [W]) is not zero."""
        inputs = [world_mask, goal]
        wp.launch(metrics.reset_metrics, world_mask.shape, inputs, [self.metrics], device=self._device)

    def measure(self, worlds: WorldRange) -> wp.Launch:
        """The kernel that measures a control step, at its end."""
        state = worlds.state
        arguments = [
            state.hands, state.objects, worlds.goal, state.diverged, state.overflow_count, self._limits,
            states.slice_worlds(metrics.EpisodeMetrics, self.metrics, worlds.rows), self._failure_count[worlds.index],
        ]  # fmt: skip
        return record(metrics.update_metrics, worlds.every_world, arguments, self._device)

    def summary(self, goal: states.Goal) -> dict[str, Array]:
        """What happened in every world since its reset, see :meth:`Environment.episode_summary`."""
        measured = {
            "final_angle": self.metrics.angle,
            "start_angle": goal.start_angle,
            "goal_angle": goal.target_angle,
            "angle_error": self.metrics.angle_error,
            "mean_angle_error": self.metrics.angle_error_mean,
            "max_angle_change": self.metrics.angle_change_max,
            "final_displacement": self.metrics.displacement,
            "mean_displacement": self.metrics.displacement_mean,
            "max_displacement": self.metrics.displacement_max,
            "max_tilt": self.metrics.tilt_max,
            "lift": self.metrics.lift,
            "turn": self.metrics.turn,
            "position_error": self.metrics.position_error,
            "mean_position_error": self.metrics.position_error_mean,
            "rotation_error": self.metrics.rotation_error,
            "least_angle_error": self.metrics.angle_error_min,
            "least_position_error": self.metrics.position_error_min,
            "least_rotation_error": self.metrics.rotation_error_min,
        }
        summary = {name: array.numpy().astype(np.float64) for name, array in measured.items()}
        failed = self.metrics.failure.numpy() != 0
        summary["failed"] = failed.astype(np.float64)
        achieved = summary["lift"] > LIFTED_HEIGHT
        if self._opens:
            achieved = np.abs(summary["final_angle"] - summary["start_angle"]) > OPENED_ANGLE
        summary["success"] = (achieved & ~failed).astype(np.float64)
        return summary

    def failure_counts(self) -> dict[str, int]:
        """Episodes so far in which each of :data:`artigrasp.kernels.metrics.FAILURES` happened, by its name."""
        return dict(zip(metrics.FAILURES, self._failure_count.numpy().sum(axis=0).tolist(), strict=True))
