"""The articulation protocol: every reference and goal angle once, from the same starts for every controller."""

import importlib.metadata
from collections.abc import Callable, Sequence

import numpy as np

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
        on_step: Called with the control steps done, for progress.

    Raises:
        UserError: An object has no articulation reference in the split.
    """
    chosen = [each.select(split=split, kind="articulate") for each in references]
    worlds = trial_worlds(chosen, goal_angles)
    environment = Environment(controller.task, chosen, worlds, seed=seed, noise=False)
    run_episode(environment, controller, on_step)
    return Evaluation(
        task=controller.task.name,
        controller=controller.name,
        policy=policy,
        objects=environment.object_names,
        split=split,
        seed=seed,
        settings=protocol_settings(controller),
        outcomes=read_outcomes(environment),
    )


def read_outcomes(environment: Environment) -> ArticulationOutcomes:
    """What happened in every world since its reset."""
    summary = environment.episode_summary()
    index = environment.reference_index.numpy()
    sources = np.concatenate([each.source for each in environment.references])
    return ArticulationOutcomes(
        object=np.array(environment.object_names)[environment.worlds.object_index],
        reference=sources[index],
        goal_angle=summary["goal_angle"],
        initial_angle=summary["start_angle"],
        final_angle=summary["final_angle"],
        opened_once=summary["max_angle_change"] > OPENED_ANGLE,
        mean_displacement=summary["mean_displacement"],
        max_displacement=summary["max_displacement"],
        final_displacement=summary["final_displacement"],
        max_tilt=summary["max_tilt"],
        diverged=summary["diverged"] > 0,
    )


def protocol_settings(controller: Controller) -> dict[str, object]:
    """What the numbers depend on besides the controller: physics settings and package versions."""
    task = controller.task
    physics = task.physics
    return {
        "base": "fixed" if task.fixed_base else "free",
        "hands": " and ".join(task.hands),
        "steps": task.episode_steps,
        "friction": physics.friction,
        "cone": physics.cone,
        "impratio": physics.impratio,
        "solref": list(physics.solref),
        "timestep": physics.timestep,
        "substeps": physics.substeps,
        **{name: importlib.metadata.version(name) for name in ("newton", "mujoco", "warp-lang")},
    }
