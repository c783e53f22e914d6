"""Whether references work: a PD hand, or else a short search, opens or lifts the object with them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller, pd_ik_controller
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.search import SearchController
from artigrasp.evaluation.articulation import GOAL_ANGLES, toward
from artigrasp.evaluation.experiment import Experiment, Trials
from artigrasp.evaluation.grasping import GRASPING, draw_targets
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks import get_task

TASK = "both-free"
"""The scene: the object is free on the table."""
LEAST_SHARE = 0.5
"""Share of the trials that must succeed."""
CRITERIA = {"articulate": "strict", "grasp": "paper"}
"""By which of its experiment's criteria a trial of each kind of reference succeeds."""
FAILED, PD_IK, SEARCH = "", "pd-ik", "search"
"""Verdicts: what a reference works with, if anything."""


@dataclass(frozen=True, eq=False)
class ReferenceCheck:
    """What became of R references.

    Attributes:
        verdict: ``"pd-ik"``, ``"search"`` or nothing where what was tried fails, shape (R,).
        success: Share of the trials in which it succeeds, shape (R,).
    """

    verdict: NDArray[np.str_]
    success: Array

    @property
    def works(self) -> NDArray[np.bool_]:
        """Which references work, shape (R,)."""
        return np.asarray(self.verdict != FAILED)

    def update(self, rows: NDArray[np.int64], other: "ReferenceCheck") -> "ReferenceCheck":
        """What became of these references once some of them were tried otherwise, those of which that succeeded."""
        verdict, success = self.verdict.astype("<U8"), self.success.copy()
        better = other.works
        verdict[rows[better]], success[rows[better]] = other.verdict[better], other.success[better]
        return ReferenceCheck(verdict, success)

    def join(self, other: "ReferenceCheck") -> "ReferenceCheck":
        """What became of these references and then of others."""
        return ReferenceCheck(
            np.concatenate([self.verdict, other.verdict]), np.concatenate([self.success, other.success])
        )


def check_references(
    references: ReferenceSet,
    *,
    trials: int = 2,
    rollouts: int = 0,
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_step: Callable[[int, int], None] = lambda done, total: None,
) -> ReferenceCheck:
    """Try every reference, without noise; the same input gives the same result.

    A trial of an articulation succeeds if the object is open at the end and its base never moved or tilted noticeably;
    one of a grasp if the object is in the air at the end.

    Args:
        references: References of one kind.
        trials: Angles to open to, or targets to carry to, that PD+IK is given.
        rollouts: Of a search toward one of them, in place of PD+IK; 0 for PD+IK.
        seed: Of targets and search.
        simulator: Backend, device and threads.
        on_step: Called with the control steps done and how many there are.
    """
    kinds = set(references.kind.tolist())
    if len(kinds) != 1:
        raise ValueError(f"references: expected those of one kind, found {', '.join(sorted(kinds)) or 'none'}")
    experiment, drawn = _trials(references, 1 if rollouts else trials, seed)
    controller: Controller = pd_ik_controller(get_task(TASK))
    if rollouts:
        settings = CrossEntropySettings(rollouts=rollouts)
        controller = SearchController(controller, settings, objectives=experiment.objectives, seed=seed)
    outcomes = experiment.run_trials(controller, [references], drawn, seed=seed, simulator=simulator, on_step=on_step)
    succeeded = experiment.criteria[CRITERIA[str(references.kind[0])]](outcomes)
    counts = np.bincount(drawn.reference, minlength=len(references))
    success = np.bincount(drawn.reference, weights=succeeded, minlength=len(references)) / counts
    return ReferenceCheck(np.where(success >= LEAST_SHARE, SEARCH if rollouts else PD_IK, FAILED), success)


def _trials(references: ReferenceSet, count: int, seed: int) -> tuple[Experiment[Any], Trials]:
    if references.kind[0] == "grasp":
        return GRASPING, draw_targets([references], seed, count)
    middle = GOAL_ANGLES[len(GOAL_ANGLES) // 2]
    goals = [middle] if count == 1 else np.linspace(GOAL_ANGLES[0], GOAL_ANGLES[-1], count).tolist()
    experiment = toward(goals)
    return experiment, experiment.draw_trials([references], seed)
