"""Controllers by name."""

from pathlib import Path

from artigrasp.config import TaskConfig
from artigrasp.controllers.controller import Controller, PolicyController, ZeroController, pd_ik_controller
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.policy_file import load_policy
from artigrasp.controllers.search import SearchController
from artigrasp.errors import UserError, unknown

CONTROLLERS = ("policy", "pd-ik", "zero", "search")
"""Names that :func:`load_controller` knows."""

SEARCH_ROLLOUTS = 64
"""Rollouts of a search for which no other number is given."""


def load_controller(name: str, *, task: TaskConfig, policy: Path | None = None, seed: int = 0) -> Controller:
    """Make a controller.

    Args:
        name: One of ``CONTROLLERS``.
        task: Scene of a controller that has no policy; a policy brings its own task.
        policy: Policy file of the controller ``policy``.
        seed: Of a search.

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
    if name == "search":
        return search_around(pd_ik_controller(task), SEARCH_ROLLOUTS, seed)
    raise unknown("controller", name, CONTROLLERS)


def search_around(controller: Controller, rollouts: int, seed: int = 0) -> Controller:
    """A search for offsets around what a controller does, see :class:`SearchController`.

    Args:
        controller: What is improved.
        rollouts: Episodes that are tried for every trial; 0 leaves the controller as it is.
        seed: Of the candidates.
    """
    if rollouts == 0:
        return controller
    return SearchController(controller, CrossEntropySettings(rollouts=rollouts), seed=seed)
