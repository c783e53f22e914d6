"""The tasks that can be trained, and the curricula of several: one readable file per family, pure typed data."""

from artigrasp.config import CurriculumConfig, TaskConfig
from artigrasp.errors import unknown
from artigrasp.tasks import artigrasp, both_grasp_replay, right_fixed_synergy, right_free_replay

TASKS: dict[str, TaskConfig] = {
    task.name: task
    for family in (artigrasp.TASKS, right_fixed_synergy.TASKS, right_free_replay.TASKS, both_grasp_replay.TASKS)
    for task in family
}
"""All tasks by name."""

CURRICULA: dict[str, CurriculumConfig] = {each.name: each for family in (artigrasp.CURRICULA,) for each in family}
"""All curricula by name."""


def get_task(name: str) -> TaskConfig:
    """The task of that name.

    Raises:
        UserError: There is none; the message suggests the nearest.
    """
    if name not in TASKS:
        raise unknown("task", name, TASKS)
    return TASKS[name]


def get_curriculum(name: str) -> CurriculumConfig:
    """The curriculum of that name; a task is one of a single stage.

    Raises:
        UserError: There is neither; the message suggests the nearest.
    """
    if name in TASKS:
        task = TASKS[name]
        return CurriculumConfig(task.name, task.description, (task,))
    if name not in CURRICULA:
        raise unknown("task", name, [*TASKS, *CURRICULA])
    return CURRICULA[name]
