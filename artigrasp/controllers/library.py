"""Controllers by name."""

from pathlib import Path

from artigrasp.config import TaskConfig
from artigrasp.controllers.controller import Controller, PolicyController, ZeroController, pd_ik_controller
from artigrasp.controllers.policy_file import load_policy
from artigrasp.errors import UserError, unknown

CONTROLLERS = ("policy", "pd-ik", "zero")
"""Names that :func:`load_controller` knows."""


def load_controller(name: str, *, task: TaskConfig, policy: Path | None = None) -> Controller:
    """Make a controller.

    Args:
        name: One of ``CONTROLLERS``.
        task: Scene of a controller that has no policy; a policy brings its own task.
        policy: Policy file of the controller ``policy``.

    Raises:
        UserError: The name is unknown, or the policy file is missing or unfit.
    """
    if name == "policy":
        if policy is None:
            raise UserError("controller: 'policy' needs a policy file: name one with --policy")
        return PolicyController(load_policy(policy))
    if name == "pd-ik":
        return pd_ik_controller(task)
    if name == "zero":
        return ZeroController(task)
    raise unknown("controller", name, CONTROLLERS)
