"""The task that a run was made with, stored beside its checkpoints as JSON."""

import json
from pathlib import Path

from artigrasp.config.parse import from_dict, to_dict
from artigrasp.config.task import TaskConfig
from artigrasp.errors import UserError
from artigrasp.files import atomic_write, check_format

FORMAT = "artigrasp.task"
VERSION = 1


def write_task(path: Path, task: TaskConfig) -> None:
    """Write a task as JSON.

    Raises:
        UserError: The file cannot be written there.
    """
    content = {"format": FORMAT, "version": VERSION, **to_dict(task)}
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def read_task(path: Path) -> TaskConfig:
    """Read a task that :func:`write_task` wrote.

    Raises:
        UserError: The file is missing, is no JSON, is of another format or a newer version, or holds a key or a
            value that no task has.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: cannot read this file: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"{path}: expected JSON, found something else: {error}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a table of keys and values, found {type(content).__name__}")
    check_format(content.pop("format", None), content.pop("version", None), FORMAT, VERSION, path)
    return from_dict(TaskConfig, content, source=str(path))
