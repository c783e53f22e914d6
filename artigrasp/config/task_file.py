"""The task that a run was made with, stored beside its checkpoints as JSON."""

from pathlib import Path

from artigrasp.config.parse import from_dict, to_dict
from artigrasp.config.task import TaskConfig
from artigrasp.files import read_json, write_json

FORMAT = "artigrasp.task"
VERSION = 1


def write_task(path: Path, task: TaskConfig) -> None:
    """Write a task as JSON.

    Raises:
        UserError: The file cannot be written there.
    """
    write_json(path, {"format": FORMAT, "version": VERSION, **to_dict(task)})


def read_task(path: Path) -> TaskConfig:
    """Read a task that :func:`write_task` wrote.

    Raises:
        UserError: The file is missing, is no JSON, is of another format or a newer version, or holds a key or a
            value that no task has.
    """
    return from_dict(TaskConfig, read_json(path, FORMAT, VERSION, "a task"), source=str(path))
