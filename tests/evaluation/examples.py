"""Outcomes made by hand."""

from typing import Any

import numpy as np

from artigrasp.config import TaskConfig
from artigrasp.controllers.search import FoundOffsets
from artigrasp.evaluation.articulation import ARTICULATION, ArticulationOutcomes
from artigrasp.evaluation.evaluate import Evaluation
from artigrasp.evaluation.experiment import Trials

TASK = TaskConfig("right-fixed", "made by hand")

QUALITY = {
    "base_distance": 0.01,
    "articulated_distance": 0.04,
    "penetration": 0.002,
    "jerk": 20.0,
    "contact_consistency": 0.8,
}
"""The columns of all outcomes that tell a motion's quality."""


def outcomes_of(count: int = 1, **columns: Any) -> ArticulationOutcomes:
    """Trials that succeed by every criterion, except for the given columns: one value for all, or one per trial."""
    fields: dict[str, Any] = {
        "object": "box",
        "reference": np.arange(count),
        "source": "made by hand",
        "failed": False,
        **QUALITY,
        "goal_angle": 1.0,
        "initial_angle": 0.0,
        "final_angle": 0.9,
        "opened_once": True,
        "mean_displacement": 0.01,
        "max_displacement": 0.02,
        "final_displacement": 0.02,
        "max_tilt": 0.1,
    }
    return ArticulationOutcomes(**{name: np.resize(value, count) for name, value in (fields | columns).items()})


def found_by_search() -> FoundOffsets:
    """What a search with eight rollouts found in four trials of one hand."""
    random = np.random.default_rng(0)
    return FoundOffsets(
        random.normal(size=(4, 1, 1, 14)).astype(np.float32),
        np.array([8, 1, 8, 3]),
        np.maximum.accumulate(random.random((4, 8)) > 0.7, axis=1),
        random.random((4, 8)),
    )


def evaluation_of(outcomes: ArticulationOutcomes, **changes: Any) -> Evaluation[ArticulationOutcomes]:
    """A measured controller."""
    fields: dict[str, Any] = {
        "experiment": ARTICULATION,
        "task": TASK,
        "controller": "policy",
        "policy": "policy.pt",
        "rollout_count": 0,
        "objects": ("box", "laptop"),
        "split": "test",
        "seed": 4,
        "settings": {"base": "fixed", "friction": 3.0},
        "trials": Trials(outcomes.object, outcomes.reference, {"goal_angle": outcomes.goal_angle}),
        "outcomes": outcomes,
        "wall_time": 2.5,
    }
    return Evaluation(**(fields | changes))
