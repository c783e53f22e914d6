"""Policies by name, and the task that comes with one."""

from pathlib import Path
from typing import TYPE_CHECKING

from artigrasp.assets.library import find_asset, find_file, list_assets

if TYPE_CHECKING:
    from artigrasp.config import TaskConfig

DEFAULT_TASK = "right-fixed"


def list_policies() -> dict[str, Path]:
    """The policy files among the assets by name; of two with one name the user's own."""
    return {name: find_asset("policies", name) for name in list_assets("policies")}


def find_policy(name: str) -> Path:
    """The file of a policy, given by its path or by its name among the assets.

    Raises:
        UserError: There is neither; suggests the nearest name.
    """
    return find_file("policies", name)


def policies_for(object_name: str) -> dict[str, Path]:
    """Policies among the assets that learned on an object, by the kind of their skill; the first of a kind by name."""
    from artigrasp.controllers.policy_file import load_policy

    found: dict[str, Path] = {}
    for path in list_policies().values():
        policy = load_policy(path)
        if object_name in policy.objects:
            for kind in policy.task.kinds:
                found.setdefault(kind, path)
    return found


def played_task(name: str | None, policy: Path | None) -> "TaskConfig":
    """The task to play: a policy's own, else the one of that name, else the default.

    Raises:
        UserError: The task is unknown, the policy file is unfit, or the policy is for another task than the named one.
    """
    from artigrasp.controllers.policy_file import load_policy
    from artigrasp.tasks import get_task

    named = get_task(DEFAULT_TASK if name is None else name)
    return named if policy is None else load_policy(policy, task=name).task
