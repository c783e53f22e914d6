"""The articulation protocol: every reference and goal angle once, from the same starts for every controller."""

import importlib.metadata
from collections.abc import Callable, Sequence

import numpy as np

from artigrasp.config import SimulatorConfig, to_dict
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.environment import OPENED_ANGLE, Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.evaluation.protocols import GOAL_ANGLES, ArticulationOutcomes
from artigrasp.evaluation.report import Evaluation
from artigrasp.references.reference import ReferenceSet


def evaluate_articulation(
    controller: Controller,
    references: Sequence[ReferenceSet],
    *,
    split: str,
    seed: int = 0,
    policy: str | None = None,
    goal_angles: Sequence[float] = GOAL_ANGLES,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_step: Callable[[int], None] = lambda step: None,
) -> Evaluation:
    """Measure a controller on the articulation references of a split.

    Hands start at their pre-grasp poses without noise, so the trials are the same for every controller and seed.

    Args:
        controller: What acts.
        references: One set per object.
        split: Split to measure.
        seed: Seed of the environment, kept with the result.
        policy: Path of the policy file, for the record.
        goal_angles: Target hinge angles [rad].
        simulator: Backend, device and threads.
        on_step: Called with the control steps done, for progress.

    Raises:
        UserError: An object has no articulation reference in the split.
    """
    chosen = [each.select(split=split, kind="articulate") for each in references]
    worlds = trial_worlds(chosen, goal_angles)
    environment = Environment(controller.task, chosen, worlds, seed=seed, noise=False, simulator=simulator)
    run_episode(environment, controller, on_step)
    return Evaluation(
        task=controller.task.name,
        controller=controller.name,
        policy=policy,
        objects=environment.object_names,
        split=split,
        seed=seed,
        settings=protocol_settings(environment),
        outcomes=read_outcomes(environment),
    )


def read_outcomes(environment: Environment) -> ArticulationOutcomes:
    """What happened in every world since its reset."""
    summary = environment.episode_summary()
    objects, rows = environment.worlds.object_index, environment.reference_rows()
    sources = [environment.references[index].source[row] for index, row in zip(objects, rows, strict=True)]
    return ArticulationOutcomes(
        object=np.array(environment.object_names)[objects],
        reference=rows,
        source=np.array(sources),
        goal_angle=summary["goal_angle"],
        initial_angle=summary["start_angle"],
        final_angle=summary["final_angle"],
        opened_once=summary["max_angle_change"] > OPENED_ANGLE,
        mean_displacement=summary["mean_displacement"],
        max_displacement=summary["max_displacement"],
        final_displacement=summary["final_displacement"],
        max_tilt=summary["max_tilt"],
        failed=summary["failed"] > 0,
    )


def protocol_settings(environment: Environment) -> dict[str, object]:
    """What the numbers depend on besides the controller: the scene, its physics and package versions."""
    task = environment.task
    return {
        "hand": environment.hand_name,
        "hands": list(task.hands),
        "base": "fixed" if task.fixed_base else "free",
        "backend": environment.simulator.backend,
        "episode_steps": task.episode_steps,
        **to_dict(task.physics),
        **{name: importlib.metadata.version(name) for name in ("newton", "mujoco", "warp-lang")},
    }
