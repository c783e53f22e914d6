"""Controllers by name."""

from pathlib import Path

from artigrasp.config import TaskConfig
from artigrasp.controllers.controller import (
    Controller,
    PolicyController,
    ZeroController,
    d_grasp_controller,
    pd_ik_controller,
)
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.policy_file import PolicyFile, load_policy
from artigrasp.controllers.search import SearchController
from artigrasp.controllers.skills import Team
from artigrasp.errors import UserError, unknown

CONTROLLERS = ("policy", "pd-ik", "d-grasp", "zero", "search")
"""Names that :func:`load_controller` knows."""

SEARCH_ROLLOUTS = 64
"""Rollouts of a search for which no other number is given."""


def load_controller(
    name: str,
    *,
    task: TaskConfig,
    policy: Path | None = None,
    grasp_policy: Path | None = None,
    search: int = 0,
    seed: int = 0,
) -> Controller:
    """Make a controller, of policy files if it needs some; see :func:`make_controller`.

    Raises:
        UserError: The name is unknown, or a policy file is missing or unfit.
    """
    read, grasps = (None if each is None else load_policy(each) for each in (policy, grasp_policy))
    return make_controller(name, task=task, policy=read, grasp_policy=grasps, search=search, seed=seed)


def make_controller(
    name: str,
    *,
    task: TaskConfig,
    policy: PolicyFile | None = None,
    grasp_policy: PolicyFile | None = None,
    search: int = 0,
    seed: int = 0,
) -> Controller:
    """Make a controller.

    Args:
        name: One of ``CONTROLLERS``; ``search`` is a search around PD+IK.
        task: Scene of a controller that has no policy; a policy brings its own task.
        policy: Policy of the controller ``policy``.
        grasp_policy: One that takes its place in the phases of a sequence in which objects are grasped and carried.
        search: Rollouts of a search around the controller, see :class:`SearchController`; 0 for none, which for the
            controller ``search`` means ``SEARCH_ROLLOUTS``.
        seed: Of a search.

    Raises:
        UserError: The name is unknown, or there is no policy for the controller ``policy``, or two that do not fit.
    """
    rollouts = search
    controller: Controller
    if name == "policy":
        controller = _acting(policy, grasp_policy)
    elif name == "pd-ik":
        controller = pd_ik_controller(task)
    elif name == "d-grasp":
        controller = d_grasp_controller(task)
    elif name == "zero":
        controller = ZeroController(task)
    elif name == "search":
        controller, rollouts = pd_ik_controller(task), search or SEARCH_ROLLOUTS
    else:
        raise unknown("controller", name, CONTROLLERS)
    if rollouts == 0:
        return controller
    if isinstance(controller, Team):
        raise UserError("search: expected a search around one controller, found one around two policies")
    return SearchController(controller, CrossEntropySettings(rollouts=rollouts), seed=seed)


def _acting(policy: PolicyFile | None, grasp_policy: PolicyFile | None) -> Controller:
    acting = [PolicyController(each) for each in (policy, grasp_policy) if each is not None]
    if not acting:
        raise UserError("controller: 'policy' needs a policy file: name one with --policy")
    return acting[0] if len(acting) == 1 else Team({"articulate": acting[0], "grasp": acting[1]})
