"""Playing trials, of one phase or a sequence of them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.config import PhaseConfig, SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.controllers.skills import in_free_scene, with_skills
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import WorldPlan
from artigrasp.evaluation.experiment import Trials
from artigrasp.evaluation.quality import QualityRecorder
from artigrasp.kernels.phases import FIRST_FAILURE, OUTCOMES
from artigrasp.references.reference import ReferenceSet


def object_indices(references: Sequence[ReferenceSet], trials: Trials) -> NDArray[np.int64]:
    """Index of the reference set of every trial."""
    index = {each.object: number for number, each in enumerate(references)}
    return np.array([index[name] for name in trials.object.tolist()])


def play_trials(
    controller: Controller, environment: Environment, on_step: Callable[[int, int], None]
) -> QualityRecorder:
    """Play one episode in every world and record how good the motions are.

    Args:
        controller: What acts.
        environment: Made for the controller's task.
        on_step: Called with the control steps done, planning included, and how many there are.
    """
    quality = QualityRecorder(environment)
    planned = controller.rollout_count * environment.episode_steps
    total = planned + environment.episode_steps

    def record(step: int) -> None:
        quality.record(step)
        on_step(planned + step, total)

    run_episode(environment, controller, record, on_plan=lambda done, _: on_step(done, total))
    return quality


def play_sequence(
    controller: Controller,
    sequence: Sequence[PhaseConfig],
    references: Sequence[ReferenceSet],
    worlds: WorldPlan,
    *,
    seed: int,
    simulator: SimulatorConfig,
    on_step: Callable[[int, int], None],
    retry_count: int = 0,
) -> tuple[Environment, QualityRecorder]:
    """Play a sequence once in every world, without noise.

    Args:
        controller: What acts in the phases whose skill it has; PD+IK acts in the others.
        sequence: Phases of PD+IK.
        references: One set per object.
        worlds: What each world plays.
        seed: Seed of the environment.
        simulator: Backend, device and threads.
        on_step: Called with the control steps done, planning included, and how many there are.
        retry_count: How often an episode may go back after a failed phase.

    Returns:
        The environment as it is at the end, and the quality of the motions.
    """
    controller = in_free_scene(controller)
    environment = Environment(
        controller.task,
        references,
        worlds,
        sequence=with_skills(sequence, controller),
        retry_count=retry_count,
        seed=seed,
        noise=False,
        simulator=simulator,
    )
    return environment, play_trials(controller, environment, on_step)


def phase_outcomes(environment: Environment) -> dict[str, NDArray[np.str_]]:
    """What became of every phase in every world, by the phase's name."""
    codes = environment.phase_outcome.numpy()
    return {phase.name: np.array(OUTCOMES)[codes[:, row]] for row, phase in enumerate(environment.phases)}


def first_failures(outcomes: Mapping[str, NDArray[np.str_]]) -> NDArray[np.str_]:
    """The first phase of every world that failed, and how, such as ``"relocate: dropped"``; empty if none did."""
    failures = OUTCOMES[FIRST_FAILURE:]
    worlds = zip(*outcomes.values(), strict=True)
    named = (zip(outcomes, world, strict=True) for world in worlds)
    return np.array([next((f"{name}: {how}" for name, how in world if how in failures), "") for world in named])


def played_references(environment: Environment) -> dict[str, Any]:
    """Object, row and source of every world's first reference: the fields with which all outcomes begin."""
    worlds = environment.worlds
    rows = environment.rows_in_sets(worlds.first_reference)
    sources = [environment.references[index].source[row] for index, row in zip(worlds.object_index, rows, strict=True)]
    return {
        "object": np.array(environment.object_names)[worlds.object_index],
        "reference": rows,
        "source": np.array(sources),
    }
