"""Controllers as the skills of a sequence: who acts in which phase."""

import copy
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from artigrasp.config import PhaseConfig, TaskConfig
from artigrasp.config.task import Kind
from artigrasp.controllers.controller import PD_IK, Controller
from artigrasp.environment.action_columns import action_count
from artigrasp.errors import UserError
from artigrasp.tasks import get_task

SCENE = "both-free"
"""Task in whose scene controllers play sequences that were made for one hand or a fixed base."""


def in_scene(controller: Controller, scene: TaskConfig) -> Controller:
    """The controller in the scene of a task: with its hands, and the base fixed or free as there.

    It keeps its priors, gains and physics, and acts for each hand as it did for its own.
    """
    task = replace(controller.task, hands=scene.hands, fixed_base=scene.fixed_base)
    if task == controller.task:
        return controller
    moved = copy.copy(controller)
    # controllers may be frozen
    object.__setattr__(moved, "task", task)
    return moved


def in_free_scene(controller: Controller) -> Controller:
    """The controller in a scene in which objects can be carried: both hands and a free base."""
    return in_scene(controller, get_task(SCENE))


class Team:
    """Controllers that share a sequence: each decides in the phases of its skill.

    All of them decide all the time, side by side in one action, of which a phase takes its controller's columns.

    Attributes:
        members: Who acts in the phases of each skill.
        task: The first one's scene.
    """

    rollout_count = 0

    def __init__(self, members: Mapping[Kind, Controller]) -> None:
        """Put controllers together.

        Args:
            members: Who acts in the phases of each skill.

        Raises:
            UserError: One has not learned its skill, or was made for other physics, features or hands than the first.
        """
        self.members = {skill: in_free_scene(member) for skill, member in members.items()}
        first = next(iter(self.members.values()))
        for skill, member in self.members.items():
            _check_member(skill, member, first)
        self.name, self.hand, self.task = first.name, first.hand, first.task

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions of all members, side by side."""
        return np.concatenate([member.act(features) for member in self.members.values()], axis=-1)

    def first_column(self, skill: Kind) -> int:
        """Where the decisions of a skill's controller begin in the action."""
        before = itertools.takewhile(lambda each: each != skill, self.members)
        return sum(action_count(self.members[each].task.action) for each in before)


def _check_member(skill: Kind, member: Controller, first: Controller) -> None:
    if skill not in member.task.kinds:
        raise UserError(
            f"policy: expected one that learned to {skill}, found one for {' and '.join(member.task.kinds)}"
        )
    if member.hand != first.hand:
        raise UserError(f"policy: expected two for the same hand, found {first.hand} and {member.hand}")
    for name in ("hands", "physics", "include_hinge_features"):
        expected, found = getattr(first.task, name), getattr(member.task, name)
        if found != expected:
            raise UserError(f"policy: expected two for tasks with the same {name}, found {expected} and {found}")


def with_skills(sequence: Sequence[PhaseConfig], controller: Controller) -> tuple[PhaseConfig, ...]:
    """The phases of a sequence in which a controller acts where it has learned to, and PD+IK elsewhere.

    It brings its priors and gains along, except where the object is carried: there the wrists follow the object's path,
    with what the controller decides on top. PD+IK has the priors of each phase, also under a search.

    Args:
        sequence: Phases of PD+IK.
        controller: What acts, or a team, of which each acts in the phases of its skill.
    """
    if isinstance(controller, Team):
        acting = {skill: (member, controller.first_column(skill)) for skill, member in controller.members.items()}
    else:
        acting = dict.fromkeys(controller.task.kinds, (controller, 0))
    return tuple(phase if phase.skill not in acting else _acted_by(*acting[phase.skill], phase) for phase in sequence)


def _acted_by(controller: Controller, first_column: int, phase: PhaseConfig) -> PhaseConfig:
    """A phase of PD+IK in which a controller acts, whose decisions begin in a column of the action."""
    task = controller.task
    action, gains = task.action, task.gains
    if phase.carries or replace(action, synergy=None, residual=None) == PD_IK:
        action, gains = replace(phase.action, synergy=action.synergy, residual=action.residual), phase.gains
    # decisions for a whole episode hold on while the object is carried
    decides = task.action.synergy is None or not phase.carries
    return replace(phase, action=action, gains=gains, decides=decides, first_column=first_column)
