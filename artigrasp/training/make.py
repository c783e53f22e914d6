"""The environment that a task is trained in: one phase of its own, or a sequence of which it learns a part."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.controllers.controller import ZeroController
from artigrasp.controllers.skills import with_skills
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment, training_references
from artigrasp.environment.worlds import training_worlds
from artigrasp.evaluation.grasping import draw_offsets
from artigrasp.tasks.sequences import GRASPING


def make_training_environment(
    task: TaskConfig,
    objects: Sequence[str],
    *,
    split: str = "train",
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
) -> Environment:
    """Worlds of a task, in which the policy acts where it learns to, and PD+IK elsewhere.

    In a sequence that carries, each world has a target of its own, drawn once from where evaluation draws them.

    Args:
        task: What is simulated and rewarded.
        objects: Names of the objects.
        split: Split whose references are played.
        seed: Seed of everything that is drawn.
        simulator: Backend, device and threads.

    Raises:
        UserError: As for :func:`make_environment`.
    """
    if task.sequence is None:
        return make_environment(task, objects, split=split, seed=seed, simulator=simulator)
    references = training_references(task, objects, split)
    offsets = draw_offsets(np.random.default_rng(seed), task.world_count).astype(np.float32)
    worlds = replace(training_worlds(references, task.world_count), target_offset=offsets)
    sequence = with_skills(GRASPING, ZeroController(task))
    return Environment(task, references, worlds, sequence=sequence, seed=seed, simulator=simulator)
