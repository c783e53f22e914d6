"""Policies for an object, and the task that comes with one."""

from typing import TYPE_CHECKING, TypeAlias

from artigrasp.assets.library import asset_files
from artigrasp.errors import UserError

if TYPE_CHECKING:
    from artigrasp.config import TaskConfig
    from artigrasp.controllers.policy_file import PolicyFile

DEFAULT_TASK = "right-fixed"

Policies: TypeAlias = "dict[str, tuple[str, PolicyFile]]"
"""Policies with their names, by the kind of their skill."""


def policies_for(object_name: str) -> Policies:
    """Policies among the assets that learned on an object.

    Of several of a kind it is the first by name.
    """
    from artigrasp.controllers.policy_file import load_policy

    found: Policies = {}
    for name, path in asset_files("policies").items():
        policy = load_policy(path)
        if object_name in policy.objects:
            for kind in policy.task.kinds:
                found.setdefault(kind, (name, policy))
    return found


def played_task(name: str | None, policy: "PolicyFile | None") -> "TaskConfig":
    """The task to play: a policy's own, else the one of that name, else the default.

    Raises:
        UserError: The task is unknown, or the policy is for another one.
    """
    from artigrasp.tasks import get_task

    named = get_task(DEFAULT_TASK if name is None else name)
    if policy is None:
        return named
    if name not in (None, policy.task.name):
        raise UserError(f"task: expected {policy.task.name!r}, for which the policy is, found {name!r}")
    return policy.task
