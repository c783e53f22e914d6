"""An environment for training or play, from names."""

from collections.abc import Sequence

from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.references.reference import load_references


def make_environment(
    task: TaskConfig,
    objects: Sequence[str],
    *,
    split: str = "train",
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
) -> Environment:
    """Share a task's worlds between objects; each world draws a reference of the split and a goal at every reset.

    Args:
        task: What is simulated and rewarded.
        objects: Names of the objects.
        split: Split whose references are played.
        seed: Seed of everything that is drawn.
        simulator: Backend, device and threads.

    Raises:
        UserError: An object, backend or device is unknown, or an object has no reference of the split and the task's
            kinds.
    """
    references = [load_references(name).select(split=split, kind=task.kinds) for name in objects]
    worlds = training_worlds(references, task.world_count)
    return Environment(task, references, worlds, seed=seed, simulator=simulator)
