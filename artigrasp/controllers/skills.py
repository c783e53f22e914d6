"""Controllers as the skills of a sequence: who acts in which phase."""

import copy
from collections.abc import Sequence
from dataclasses import replace

from artigrasp.config import PhaseConfig
from artigrasp.controllers.controller import PD_IK, Controller
from artigrasp.tasks import get_task

SCENE = "both-free"
"""Task in whose scene controllers play sequences that were made for a fixed base."""


def in_free_scene(controller: Controller) -> Controller:
    """The controller in a scene in which objects can be carried: its task's, or if the base is fixed there, another's.

    It keeps its priors, gains and physics, and acts for each hand as it did for its own.
    """
    task = controller.task
    if not task.fixed_base:
        return controller
    scene = get_task(SCENE)
    moved = copy.copy(controller)
    # controllers may be frozen
    object.__setattr__(moved, "task", replace(task, hands=scene.hands, fixed_base=False))
    return moved


def with_skills(sequence: Sequence[PhaseConfig], controller: Controller) -> tuple[PhaseConfig, ...]:
    """The phases of a sequence in which a controller acts where it has learned to, and PD+IK elsewhere.

    It brings its priors and gains along, except where the object is carried: there the wrists follow the object's path,
    with what the controller decides on top. PD+IK has the priors of each phase, also under a search.

    Args:
        sequence: Phases of PD+IK.
        controller: What acts.
    """
    task = controller.task
    is_pd_ik = replace(task.action, synergy=None, residual=None) == PD_IK
    phases = []
    for phase in sequence:
        if phase.skill in task.kinds:
            action, gains = task.action, task.gains
            if phase.carries or is_pd_ik:
                action, gains = replace(phase.action, synergy=action.synergy, residual=action.residual), phase.gains
            # decisions for a whole episode hold on while the object is carried
            decides = task.action.synergy is None or not phase.carries
            phase = replace(phase, action=action, gains=gains, decides=decides)
        phases.append(phase)
    return tuple(phases)
