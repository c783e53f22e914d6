"""Measuring a policy while it is trained: as it will act, without exploration, on the same few trials every time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import PolicyController
from artigrasp.controllers.policy_file import PolicyFile
from artigrasp.evaluation.articulation import ARTICULATION
from artigrasp.evaluation.evaluate import evaluate
from artigrasp.evaluation.experiment import Experiment
from artigrasp.evaluation.grasping import GRASPING
from artigrasp.references.reference import load_references
from artigrasp.training.learning_curve import read_points, write_points

EVALUATIONS_FILE = "evaluations.csv"


@dataclass(frozen=True)
class EvaluationPoint:
    """What one evaluation measured, by the paper's criteria; what a task has no references for is no number."""

    iteration: int
    control_steps: int
    """Control steps of training so far, over all worlds and processes."""
    wall_time: float
    """Training time so far, evaluations not counted [s]."""
    cpu_time: float
    """Processor time of that [s]."""
    suc_a: float = math.nan
    aae: float = math.nan
    sd: float = math.nan
    suc_g: float = math.nan
    pe: float = math.nan
    ae: float = math.nan

    @property
    def score(self) -> float:
        """Mean of the success rates, by which policies are compared."""
        rates = [rate for rate in (self.suc_a, self.suc_g) if math.isfinite(rate)]
        return sum(rates) / len(rates)


@dataclass(frozen=True)
class PeriodicEvaluation:
    """The trials of a run's evaluations."""

    objects: tuple[str, ...]
    split: str
    """Split whose references are played. The best policy is chosen by them: results on these are no test."""
    per_object: int
    """Trials of each object and kind, spread evenly over its references."""
    simulator: SimulatorConfig = SimulatorConfig()

    def measure(self, policy: PolicyFile) -> dict[str, float]:
        """Rates of success and mean errors, by their names in :class:`EvaluationPoint`; empty if nothing can be shown.

        Articulation is measured where it is learned, grasping where objects can be lifted.
        """
        references = [load_references(name) for name in self.objects]
        task = policy.task
        experiments: list[Experiment[Any]] = [ARTICULATION] if "articulate" in task.kinds else []
        if "grasp" in task.kinds and not task.fixed_base:
            experiments.append(GRASPING)
        results: dict[str, float] = {}
        for experiment in experiments:
            of_kind = [each for each in references if np.isin(each.kind, experiment.kinds).any()]
            evaluation = evaluate(
                PolicyController(policy),
                of_kind,
                experiment,
                split=self.split,
                per_object=self.per_object,
                simulator=self.simulator,
            )
            assert evaluation is not None  # there is but one process
            outcomes = evaluation.outcomes
            results[experiment.success.key] = float(experiment.criteria["paper"](outcomes).mean())
            for metric in experiment.metrics:
                if metric.key in _COLUMNS:
                    results[metric.key] = float(getattr(outcomes, metric.column).mean())
        return results


_COLUMNS = {field.name for field in fields(EvaluationPoint)}


def read_evaluations(folder: Path) -> list[EvaluationPoint]:
    """The evaluations of a run so far.

    Raises:
        UserError: The file is malformed.
    """
    return read_points(folder / EVALUATIONS_FILE, EvaluationPoint)


def write_evaluations(folder: Path, points: Sequence[EvaluationPoint]) -> None:
    """Write the evaluations of a run."""
    write_points(folder / EVALUATIONS_FILE, points, EvaluationPoint)
