"""Controllers as the skills of a sequence: who acts in which phase."""

from collections.abc import Sequence
from dataclasses import replace

from artigrasp.config import PhaseConfig
from artigrasp.controllers.controller import PD_IK, Controller
from artigrasp.errors import UserError


def with_skills(sequence: Sequence[PhaseConfig], controller: Controller) -> tuple[PhaseConfig, ...]:
    """The phases of a sequence in which a controller acts where it has learned to, and PD+IK elsewhere.

    It brings its priors and gains along, except where the object is carried: there the wrists follow the object's path,
    with what the controller decides on top. PD+IK has the priors of each phase, also under a search.

    Args:
        sequence: Phases of PD+IK.
        controller: What acts.

    Raises:
        UserError: The controller's task has a fixed base, so that nothing can be carried in its scene.
    """
    task = controller.task
    if task.fixed_base and any(phase.carries for phase in sequence):
        raise UserError(f"task {task.name!r}: expected one with a free base, whose object can be carried")
    terms = {"synergy": task.action.synergy, "residual": task.action.residual}
    is_pd_ik = replace(task.action, synergy=None, residual=None) == PD_IK
    phases = []
    for phase in sequence:
        if phase.skill in task.kinds:
            action, gains = task.action, task.gains
            if phase.carries or is_pd_ik:
                action, gains = replace(phase.action, **terms), phase.gains
            # decisions for a whole episode hold on while the object is carried
            decides = task.action.synergy is None or not phase.carries
            phase = replace(phase, action=action, gains=gains, decides=decides)
        phases.append(phase)
    return tuple(phases)
