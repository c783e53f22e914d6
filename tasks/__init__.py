"""The tasks that can be trained, and the curricula of several: one readable file per family, pure typed data."""

from artigrasp.config import CurriculumConfig, TaskConfig
from artigrasp.errors import unknown
from artigrasp.tasks import artigrasp, both_grasp_replay, right_fixed_synergy, right_free_replay

FAMILIES = (artigrasp, right_fixed_synergy, right_free_replay, both_grasp_replay)
"""The files that hold tasks."""

TASKS: dict[str, TaskConfig] = {task.name: task for family in FAMILIES for task in family.TASKS}
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
