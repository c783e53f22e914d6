"""An environment for training or play, from names."""

from collections.abc import Sequence

import numpy as np

from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.references.reference import ReferenceSet, load_references


def make_environment(
    task: TaskConfig,
    objects: Sequence[str],
    *,
    split: str = "train",
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
) -> Environment:
    """Make the worlds of a task; each draws a reference of the split and a goal at every reset.

    Args:
        task: What is simulated and rewarded.
        objects: Names of the objects, between which and the kinds of references the worlds are shared.
        split: Split whose references are played.
        seed: Seed of everything that is drawn.
        simulator: Backend, device and threads.

    Returns:
        An environment of ``task.world_count`` worlds that has yet to be reset.

    Raises:
        UserError: An object, backend or device is unknown, or an object has no reference of the split and the task's
            kinds in which one of its hands takes part.
    """
    references = training_references(task, objects, split)
    worlds = training_worlds(references, task.world_count, evenly_of_kinds=True)
    return Environment(task, references, worlds, seed=seed, simulator=simulator)


def training_references(task: TaskConfig, objects: Sequence[str], split: str) -> list[ReferenceSet]:
    """Of every object the references in which one of the task's hands takes part, those of a kind side by side.

    Raises:
        UserError: An object has none of the split and the task's kinds.
    """
    chosen = []
    for name in objects:
        references = load_references(name).select(split=split, kind=task.kinds, hands=task.hands)
        chosen.append(references.select(indices=np.argsort(references.kind, kind="stable")))
    return chosen
