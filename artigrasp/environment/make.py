"""An environment for training or play, from names."""

from collections.abc import Sequence

from artigrasp.config import TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.references.reference import load_references


def make_environment(
    task: TaskConfig,
    objects: Sequence[str],
    *,
    split: str = "train",
    seed: int = 0,
    backend: str = "cpu",
    device: str | None = None,
    thread_count: int | None = None,
) -> Environment:
    """Share a task's worlds between objects; each world draws a reference of the split and a goal at every reset.

    Args:
        task: What is simulated and rewarded.
        objects: Names of the objects.
        split: Split whose references are played.
        seed: Seed of everything that is drawn.
        backend: Physics, see :mod:`artigrasp.simulation.backend`.
        device: Warp device of the backend.
        thread_count: Threads of the physics, all cores by default.

    Raises:
        UserError: An object, backend or device is unknown, or an object has no reference of the split and the task's
            kinds.
    """
    references = [load_references(name).select(split=split, kind=task.kinds) for name in objects]
    worlds = training_worlds(references, task.world_count)
    return Environment(task, references, worlds, seed=seed, backend=backend, device=device, thread_count=thread_count)
