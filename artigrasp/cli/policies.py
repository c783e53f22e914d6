"""Policies by name, and the task that comes with one."""

from pathlib import Path
from typing import TYPE_CHECKING

from artigrasp.assets.library import asset_roots
from artigrasp.errors import unknown

if TYPE_CHECKING:
    from artigrasp.config import TaskConfig

DEFAULT_TASK = "right-fixed"


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
