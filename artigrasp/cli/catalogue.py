"""What a command line may name: tasks and policies (objects and references are assets)."""

import importlib
import pkgutil
from pathlib import Path

import artigrasp.tasks
from artigrasp.assets.library import asset_roots
from artigrasp.config import TaskConfig
from artigrasp.errors import unknown


def list_tasks() -> dict[str, TaskConfig]:
    """Every task by name: the constant ``TASK`` of each module in the package of tasks that has one."""
    names = sorted(module.name for module in pkgutil.iter_modules(artigrasp.tasks.__path__))
    modules = [importlib.import_module(f"artigrasp.tasks.{name}") for name in names]
    tasks: list[TaskConfig] = [module.TASK for module in modules if hasattr(module, "TASK")]
    return {task.name: task for task in tasks}


def find_task(name: str) -> TaskConfig:
    """The task of a name.

    Raises:
        UserError: There is none; suggests the nearest.
    """
    tasks = list_tasks()
    if name not in tasks:
        raise unknown("task", name, tasks)
    return tasks[name]


def list_policies() -> dict[str, Path]:
    """The policy files among the assets by name; of two with one name the user's own."""
    return {path.stem: path for root in reversed(asset_roots()) for path in sorted((root / "policies").glob("*.pt"))}


def find_policy(name: str) -> Path:
    """The file of a policy, given by its path or by its name among the assets.

    Raises:
        UserError: There is neither; suggests the nearest name.
    """
    if (path := Path(name)).is_file():
        return path
    policies = list_policies()
    if name not in policies:
        raise unknown("policy", name, policies)
    return policies[name]
