"""The tasks that can be trained: one readable file each, pure typed data."""

from artigrasp.config import TaskConfig
from artigrasp.errors import unknown
from artigrasp.tasks import both_free, right_fixed, right_fixed_synergy

TASKS: dict[str, TaskConfig] = {
    module.TASK.name: module.TASK for module in (right_fixed, right_fixed_synergy, both_free)
}
"""All tasks by name."""


def get_task(name: str) -> TaskConfig:
    """The task of that name.

    Raises:
        UserError: There is none; the message suggests the nearest.
    """
    if name not in TASKS:
        raise unknown("task", name, TASKS)
    return TASKS[name]
