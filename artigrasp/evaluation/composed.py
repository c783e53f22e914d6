"""The composed task: grasp the object, carry it to a target pose on the table, and open it there."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.search import Objective
from artigrasp.environment.measuring import REACHED_DISTANCE, REACHED_TURN
from artigrasp.environment.worlds import planned_worlds
from artigrasp.errors import UserError
from artigrasp.evaluation.experiment import Experiment, Metric, Trials
from artigrasp.evaluation.outcomes import AT_POSE, HingeOutcomes, PoseOutcomes
from artigrasp.evaluation.sequences import (
    first_failures,
    object_indices,
    phase_outcomes,
    play_sequence,
    played_references,
)
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks.sequences import GRASP_THEN_ARTICULATE

TARGET_SHIFT = (-0.1, -0.05)
"""Range of the target's shift from the start along x and along y [m] (paper, supplement)."""

TARGET_YAW = 0.4
"""Largest turn of the target about the vertical [rad]."""

TARGET_ANGLE = (0.5, 0.6)
"""Range of the way from the start to the target's hinge angle [rad]."""

OPEN_ANGLE = 1.0
"""Hinge angle at the start beyond which an object is to be closed by that much, not opened further (the authors'
script) [rad]: bottles stand open, as far as their caps go."""

REACHED_ANGLE, STRICT_REACHED_ANGLE = 0.5, 0.2
"""Hinge angle error that counts as reached [rad]: the paper's lets a closed lid pass, the strict one does not."""

LOST_DISTANCE, LOST_ANGLE = 1.0, 2.0
"""The authors' script voids trials that end beyond this distance from the target [m] or this hinge angle [rad]."""


@dataclass(frozen=True)
class ComposedOutcomes(HingeOutcomes, PoseOutcomes):
    """What happened in each trial of the composed task; every array has the shape [trial]."""

    grouping: ClassVar[tuple[tuple[str, ...], ...]] = (("object", "reference"), ("object", "articulation"))

    articulation: NDArray[np.int64]
    """Index among the object's articulation references of the split; ``reference`` is that of the grasp."""
    articulation_source: NDArray[np.str_]
    least_position_error: Array
    """The least distance of the base from its target at any step [m]."""
    least_rotation_error: Array
    least_angle_error: Array
    failed_phase: NDArray[np.str_]
    """The first phase that failed, and how; empty if none did."""

    @property
    def cause(self) -> NDArray[np.str_]:
        """What went wrong first."""
        return np.where(self.failed, "physics", self.failed_phase)


def paper_success(outcomes: ComposedOutcomes) -> NDArray[np.bool_]:
    """At the target pose and angle at the end (paper, Metrics)."""
    return _reached(outcomes, REACHED_ANGLE)


def strict_success(outcomes: ComposedOutcomes) -> NDArray[np.bool_]:
    """The same, with an angle that a closed lid does not reach."""
    return _reached(outcomes, STRICT_REACHED_ANGLE)


def released_success(outcomes: ComposedOutcomes) -> NDArray[np.bool_]:
    """Each of the three was reached at some step, and nothing was lost at the end (the authors' script).

    Their script compares one Euler angle, which is no turn about the vertical for every object; here it is the angle
    between the rotations.
    """
    reached = (
        (outcomes.least_position_error < REACHED_DISTANCE)
        & (outcomes.least_rotation_error < REACHED_TURN)
        & (outcomes.least_angle_error < REACHED_ANGLE)
    )
    kept = (outcomes.position_error < LOST_DISTANCE) & (outcomes.final_angle < LOST_ANGLE)
    return np.asarray(reached & kept & ~outcomes.failed)


def draw_pairs(references: Sequence[ReferenceSet], seed: int) -> Trials:
    """Every grasp with every articulation of an object, and a target that follows from the seed and the two alone.

    Raises:
        UserError: An object has no grasp or no articulation reference.
    """
    objects, firsts, seconds, offsets, angles = [], [], [], [], []
    for each in references:
        grasps, articulations = (np.flatnonzero(each.kind == kind) for kind in ("grasp", "articulate"))
        for kind, rows in (("grasp", grasps), ("articulation", articulations)):
            if not len(rows):
                raise UserError(f"{each.object}: expected at least one {kind} reference of the split, found none")
        for first in grasps.tolist():
            for second in articulations.tolist():
                name = f"{each.object} {each.source[first]} {each.source[second]}"
                random = np.random.default_rng([seed, zlib.crc32(name.encode())])
                shift = random.uniform(*TARGET_SHIFT, 2)
                yaw = Rotation.from_rotvec([0.0, 0.0, random.uniform(-TARGET_YAW, TARGET_YAW)])
                objects.append(each.object)
                firsts.append(first)
                seconds.append(second)
                offsets.append([*shift, 0.0, *yaw.as_quat()])
                way = -1.0 if each.object_angle[first] > OPEN_ANGLE else 1.0
                angles.append(each.object_angle[first] + way * random.uniform(*TARGET_ANGLE))
    targets = {
        "second_reference": np.array(seconds),
        "target_offset": np.array(offsets),
        "goal_angle": np.array(angles),
    }
    return Trials(np.array(objects), np.array(firsts), targets)


def run_trials(
    controller: Controller,
    references: Sequence[ReferenceSet],
    trials: Trials,
    *,
    seed: int,
    simulator: SimulatorConfig,
    on_step: Callable[[int, int], None],
    retry_count: int = 0,
) -> ComposedOutcomes:
    """Play every trial in a world of its own, without noise; see :class:`RunTrials`.

    Besides, an episode may go back after a failed phase, ``retry_count`` times.
    """
    objects, second = object_indices(references, trials), trials.targets["second_reference"]
    worlds = planned_worlds(
        references,
        objects,
        trials.reference,
        trials.targets["goal_angle"],
        second_reference=second,
        target_offset=trials.targets["target_offset"],
    )
    environment, quality = play_sequence(
        controller,
        GRASP_THEN_ARTICULATE,
        references,
        worlds,
        seed=seed,
        simulator=simulator,
        on_step=on_step,
        retry_count=retry_count,
    )
    summary = environment.episode_summary()
    sources = [references[index].source[row] for index, row in zip(objects, second, strict=True)]
    grasp, articulation = (
        np.array([_row_of_kind(references[index], row) for index, row in zip(objects, rows, strict=True)])
        for rows in (trials.reference, second)
    )
    return ComposedOutcomes(
        **played_references(environment) | {"reference": grasp},
        failed=summary["failed"] > 0,
        **quality.columns(),
        articulation=articulation,
        articulation_source=np.array(sources),
        goal_angle=summary["goal_angle"],
        final_angle=summary["final_angle"],
        position_error=summary["position_error"],
        rotation_error=summary["rotation_error"],
        least_position_error=summary["least_position_error"],
        least_rotation_error=summary["least_rotation_error"],
        least_angle_error=summary["least_angle_error"],
        failed_phase=first_failures(phase_outcomes(environment)),
    )


def _reached(outcomes: ComposedOutcomes, angle: float) -> NDArray[np.bool_]:
    return np.asarray(outcomes.at_pose & (outcomes.angle_error < angle) & ~outcomes.failed)


def _row_of_kind(references: ReferenceSet, row: int) -> int:
    """Index of a reference among those of its kind."""
    return int((references.kind[:row] == references.kind[row]).sum())


def _paper_row(success: float, distance: float, angle: float, hinge: float) -> Mapping[str, float]:
    return {"suc_t": success, "pe": distance, "ae": angle, "aae": hinge}


PUT_IN_PLACE = Objective(
    within=AT_POSE,
    weights={"position_error": -5.0, "rotation_error": -1.0, "mean_position_error": -2.0, "max_tilt": -0.2},
    error="position_error",
    # opening moves it further
    enough={"position_error": (-np.inf, 0.03), "rotation_error": (-np.inf, 0.12)},
)
"""To carry the object to its target on the table and leave it there."""

OPEN_IN_PLACE = Objective(
    within={**AT_POSE, "angle_error": (-np.inf, REACHED_ANGLE)},
    weights={"angle_error": -1.0, "position_error": -5.0, "rotation_error": -1.0, "mean_angle_error": -0.2},
    error="angle_error",
    enough={"angle_error": (-np.inf, STRICT_REACHED_ANGLE)},
)
"""To open it there."""

COMPOSED = Experiment(
    name="composed",
    kinds=("articulate", "grasp"),
    draw_trials=draw_pairs,
    run_trials=run_trials,
    outcomes=ComposedOutcomes,
    success=Metric("suc_t", "Suc.T", ""),
    criteria={"paper": paper_success, "released": released_success, "strict": strict_success},
    metrics=(
        Metric("pe", "PE m", "position_error"),
        Metric("ae", "AE rad", "rotation_error"),
        Metric("aae", "AAE rad", "angle_error"),
    ),
    sequence=GRASP_THEN_ARTICULATE,
    objectives=(PUT_IN_PLACE, OPEN_IN_PLACE),
    target=Metric("goal_angle", "goal angle [rad]", "goal_angle"),
    paper_rows={
        "test": {"D-Grasp": _paper_row(0.11, 0.05, 0.15, 0.66), "ArtiGrasp": _paper_row(0.50, 0.03, 0.10, 0.41)}
    },
    paper_note="about 7500 pairs of eight ARCTIC objects, another simulator; errors as the authors' script clips them",
)
"""Suc.T, PE, AE and AAE of the paper's Table 2."""


def with_retries(count: int) -> Experiment[ComposedOutcomes]:
    """The experiment in which an episode may go back so many times after a failed phase.

    Raises:
        UserError: The count is negative.
    """
    if count < 0:
        raise UserError(f"retries: expected 0 or more, found {count}")
    return replace(COMPOSED, run_trials=partial(run_trials, retry_count=count), retry_count=count)
