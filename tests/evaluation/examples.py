"""Outcomes made by hand."""

from typing import Any

import numpy as np

from artigrasp.evaluation.protocols import ArticulationOutcomes
from artigrasp.evaluation.report import Evaluation


def outcomes_of(count: int = 1, **columns: Any) -> ArticulationOutcomes:
    """Trials that succeed in every protocol, except for the given columns: one value for all, or one per trial."""
    fields: dict[str, Any] = {
        "object": "box",
        "reference": np.arange(count),
        "source": "made by hand",
        "goal_angle": 1.0,
        "initial_angle": 0.0,
        "final_angle": 0.9,
        "opened_once": True,
        "mean_displacement": 0.01,
        "max_displacement": 0.02,
        "final_displacement": 0.02,
        "max_tilt": 0.1,
        "failed": False,
    }
    return ArticulationOutcomes(**{name: np.resize(value, count) for name, value in (fields | columns).items()})


def evaluation_of(outcomes: ArticulationOutcomes, **changes: Any) -> Evaluation:
    """A measured controller."""
    fields: dict[str, Any] = {
        "task": "right-fixed",
        "controller": "policy",
        "policy": "policy.pt",
        "objects": ("box", "laptop"),
        "split": "test",
        "seed": 4,
        "settings": {"base": "fixed", "friction": 3.0},
        "outcomes": outcomes,
    }
    return Evaluation(**(fields | changes))
