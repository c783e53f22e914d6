"""What counts as success: the paper's text, the authors' scripts, and what a viewer would call success."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.environment.environment import OPENED_ANGLE
from artigrasp.evaluation.statistics import Estimate, estimate_mean, estimate_rate

GOAL_ANGLES = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Target angles of the articulation protocol [rad] (paper, supplement, Grasping and Articulation)."""

RELEASED_ANGLE_LIMIT = 2.0
RELEASED_DISPLACEMENT_LIMIT = 0.4
"""The authors' script voids trials that end beyond this angle [rad] or base displacement [m]."""

STRICT_DISPLACEMENT_LIMIT = 0.05
STRICT_TILT_LIMIT = 0.3
"""At every step the base must stay within this distance [m] and tilt [rad] of its start."""


@dataclass(frozen=True)
class ArticulationOutcomes:
    """What happened in each articulation trial; every array has the shape [trial]."""

    object: NDArray[np.str_]
    reference: NDArray[np.int64]
    """Index among the object's articulation references of the split, as `artigrasp generate --reference` counts."""
    source: NDArray[np.str_]
    """Where the reference came from."""
    goal_angle: NDArray[np.float64]
    initial_angle: NDArray[np.float64]
    final_angle: NDArray[np.float64]
    opened_once: NDArray[np.bool_]
    """Whether the angle changed by more than 0.3 rad at any step."""
    mean_displacement: NDArray[np.float64]
    """Distance of the base origin from its start, mean over the steps [m]."""
    max_displacement: NDArray[np.float64]
    final_displacement: NDArray[np.float64]
    max_tilt: NDArray[np.float64]
    """Largest angle between the vertical and where the direction that was up at the start points [rad]."""
    failed: NDArray[np.bool_]
    """Whether the physics failed; such a trial never counts as success, and its errors are those measured before."""

    @property
    def angle_error(self) -> NDArray[np.float64]:
        """|goal − final angle| [rad]."""
        return np.asarray(np.abs(self.goal_angle - self.final_angle))

    @property
    def groups(self) -> NDArray[np.int64]:
        """Number of the object and reference that a trial shares with others."""
        pairs = np.rec.fromarrays([self.object, self.reference])
        return np.asarray(np.unique(pairs, return_inverse=True)[1])

    def select(self, mask: NDArray[np.bool_]) -> "ArticulationOutcomes":
        """The trials where the mask is true."""
        return ArticulationOutcomes(**{name: value[mask] for name, value in vars(self).items()})


def paper_success(outcomes: ArticulationOutcomes) -> NDArray[np.bool_]:
    """The final angle differs by more than 0.3 rad from the initial one (paper, Metrics)."""
    return np.asarray((np.abs(outcomes.final_angle - outcomes.initial_angle) > OPENED_ANGLE) & ~outcomes.failed)


def released_success(outcomes: ArticulationOutcomes) -> NDArray[np.bool_]:
    """Opened once and at the end, unless the angle or the base ran away (the authors' evaluation script)."""
    kept = (outcomes.final_angle <= RELEASED_ANGLE_LIMIT) & (outcomes.final_displacement <= RELEASED_DISPLACEMENT_LIMIT)
    return np.asarray(paper_success(outcomes) & outcomes.opened_once & kept)


def strict_success(outcomes: ArticulationOutcomes) -> NDArray[np.bool_]:
    """Opened at the end while the base never moved or tilted noticeably."""
    still = (outcomes.max_displacement < STRICT_DISPLACEMENT_LIMIT) & (outcomes.max_tilt < STRICT_TILT_LIMIT)
    return np.asarray(paper_success(outcomes) & still)


PROTOCOLS: dict[str, Callable[[ArticulationOutcomes], NDArray[np.bool_]]] = {
    "paper": paper_success,
    "released": released_success,
    "strict": strict_success,
}


def measure_articulation(outcomes: ArticulationOutcomes) -> dict[str, dict[str, Estimate]]:
    """Suc.A, AAE [rad] and SD [m] in every protocol, over all trials, failed ones included."""
    groups = outcomes.groups
    errors = {
        "aae": estimate_mean(outcomes.angle_error, groups),
        "sd": estimate_mean(outcomes.mean_displacement, groups),
    }
    return {name: {"suc_a": estimate_rate(success(outcomes), groups), **errors} for name, success in PROTOCOLS.items()}
