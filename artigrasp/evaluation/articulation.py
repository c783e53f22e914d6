"""The articulation experiment: every reference and goal angle once, from the same starts for every controller."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.search import OPEN
from artigrasp.environment.environment import Environment
from artigrasp.environment.measuring import OPENED_ANGLE
from artigrasp.environment.worlds import planned_worlds
from artigrasp.errors import UserError
from artigrasp.evaluation.experiment import Experiment, Metric, Trials
from artigrasp.evaluation.outcomes import HingeOutcomes
from artigrasp.evaluation.quality import QualityRecorder
from artigrasp.evaluation.sequences import object_indices, play_trials, played_references
from artigrasp.references.reference import ReferenceSet

GOAL_ANGLES = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Target angles [rad] (paper, supplement, Grasping and Articulation)."""

RELEASED_ANGLE_LIMIT = 2.0
RELEASED_DISPLACEMENT_LIMIT = 0.4
"""The authors' script voids trials that end beyond this angle [rad] or base displacement [m]."""

UNMOVED_ANGLE = 0.05
"""Change of the hinge angle up to which a hinge hardly moved [rad]."""

STRICT_DISPLACEMENT_LIMIT = 0.05
STRICT_TILT_LIMIT = 0.3
"""At every step the base must stay within this distance [m] and tilt [rad] of its start."""


@dataclass(frozen=True)
class ArticulationOutcomes(HingeOutcomes):
    """What happened in each articulation trial; every array has the shape [trial]."""

    initial_angle: Array
    opened_once: NDArray[np.bool_]
    """Whether the angle changed by more than 0.3 rad at any step."""
    mean_displacement: Array
    """Distance of the base origin from its start, mean over the steps [m]."""
    max_displacement: Array
    final_displacement: Array
    max_tilt: Array
    """Largest angle between the vertical and where the direction that was up at the start points [rad]."""

    @property
    def cause(self) -> NDArray[np.str_]:
        """How the hinge failed to open."""
        moved = np.abs(self.final_angle - self.initial_angle) > UNMOVED_ANGLE
        how = np.where(self.opened_once, "fell shut again", np.where(moved, "opened too little", "hardly moved"))
        return np.where(self.failed, "physics", how)


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


def trials_toward(references: Sequence[ReferenceSet], goal_angles: Sequence[float]) -> Trials:
    """Every reference toward every goal angle."""
    counts = [len(each) * len(goal_angles) for each in references]
    rows = [np.repeat(np.arange(len(each)), len(goal_angles)) for each in references]
    goals = np.tile(np.asarray(goal_angles, dtype=np.float64), sum(len(each) for each in references))
    names = np.repeat([each.object for each in references], counts)
    return Trials(names, np.concatenate(rows), {"goal_angle": goals})


def run_trials(
    controller: Controller,
    references: Sequence[ReferenceSet],
    trials: Trials,
    *,
    seed: int,
    simulator: SimulatorConfig,
    on_step: Callable[[int, int], None],
) -> ArticulationOutcomes:
    """Play every trial in a world of its own, without noise; see :class:`RunTrials`."""
    objects = object_indices(references, trials)
    worlds = planned_worlds(references, objects, trials.reference, trials.targets["goal_angle"])
    environment = Environment(controller.task, references, worlds, seed=seed, noise=False, simulator=simulator)
    return read_outcomes(environment, play_trials(controller, environment, on_step))


def read_outcomes(environment: Environment, quality: QualityRecorder) -> ArticulationOutcomes:
    """What happened in every world since its reset."""
    summary = environment.episode_summary()
    return ArticulationOutcomes(
        **played_references(environment),
        failed=summary["failed"] > 0,
        **quality.columns(),
        goal_angle=summary["goal_angle"],
        initial_angle=summary["start_angle"],
        final_angle=summary["final_angle"],
        opened_once=summary["max_angle_change"] > OPENED_ANGLE,
        mean_displacement=summary["mean_displacement"],
        max_displacement=summary["max_displacement"],
        final_displacement=summary["final_displacement"],
        max_tilt=summary["max_tilt"],
    )


def _paper_row(success: float, error: float, distance: float) -> Mapping[str, float]:
    return {"suc_a": success, "aae": error, "sd": distance}


ARTICULATION = Experiment(
    name="articulation",
    kinds=("articulate",),
    draw_trials=lambda references, seed: trials_toward(references, GOAL_ANGLES),
    run_trials=run_trials,
    outcomes=ArticulationOutcomes,
    success=Metric("suc_a", "Suc.A", ""),
    criteria={"paper": paper_success, "released": released_success, "strict": strict_success},
    metrics=(Metric("aae", "AAE rad", "angle_error"), Metric("sd", "SD m", "mean_displacement")),
    objectives=(OPEN,),
    target=Metric("goal_angle", "goal angle [rad]", "goal_angle"),
    paper_rows={
        "test": {
            "PD+IK": _paper_row(0.28, 0.80, 0.39),
            "D-Grasp": _paper_row(0.22, 0.93, 0.49),
            "ArtiGrasp": _paper_row(0.55, 0.57, 0.01),
        },
        "recon": {"D-Grasp": _paper_row(0.20, 1.07, 0.63), "ArtiGrasp": _paper_row(0.54, 0.55, 0.01)},
        "recon-mocap": {"ArtiGrasp": _paper_row(0.54, 0.53, 0.01)},
    },
    paper_note="eight ARCTIC objects on a free base, both hands, another simulator",
)
"""Suc.A, AAE and SD of the paper's Tables 1 and 3."""


def toward(goal_angles: Sequence[float]) -> Experiment[ArticulationOutcomes]:
    """The experiment with other target angles than the paper's [rad].

    Raises:
        UserError: One of them is none that a hinge could be opened by.
    """
    for angle in goal_angles:
        if not 0.0 <= angle <= 2 * np.pi:
            raise UserError(f"goal-angles: expected angles from 0 to a turn, 6.28 rad, found {angle:g}")
    return replace(ARTICULATION, draw_trials=lambda references, seed: trials_toward(references, goal_angles))
