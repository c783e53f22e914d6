"""What the numbers of an action mean: which column belongs to which term and direction, and for how long it holds."""

from collections.abc import Sequence

from artigrasp.config import ActionConfig, PhaseConfig, SynergyConfig
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.kernels.synergies import FINGER_SYNERGIES, SYNERGIES, WRIST_SYNERGIES

FOR_EVER = 2**31 - 1
"""Control steps for which a decision holds after which there is none."""


def synergy_scales(config: SynergyConfig) -> dict[str, float]:
    """Scale of each of ``SYNERGIES``; a direction with a scale of zero is not in use."""
    scales = dict.fromkeys(WRIST_SYNERGIES[:3], config.wrist_translation)
    scales |= dict.fromkeys(WRIST_SYNERGIES[3:], config.wrist_rotation)
    scales |= dict.fromkeys(FINGER_SYNERGIES, config.thumb)
    scales["finger_flexion"] = config.finger_flexion
    scales |= {"lead": config.hinge_lead, "squeeze": config.squeeze, "press": config.press}
    return {name: scales[name] for name in SYNERGIES}


def synergy_directions(config: SynergyConfig | None) -> list[str]:
    """Those of ``SYNERGIES`` that are in use, in the order of their columns in the action."""
    return [] if config is None else [name for name, scale in synergy_scales(config).items() if scale > 0.0]


def action_count(config: ActionConfig) -> int:
    """Length of one hand's action."""
    return len(synergy_directions(config.synergy)) + (DOF_COUNT if config.residual is not None else 0)


def last_column(phase: PhaseConfig) -> int:
    """Length that one hand's action must have to hold what is decided for a phase."""
    count = action_count(phase.action)
    return phase.first_column + count if count else 0


def term_columns(configs: Sequence[PhaseConfig], name: str) -> tuple[list[list[int]], list[int]]:
    """For every phase, the columns of a term's numbers in the action and its decision interval, see `latch_actions`.

    What is decided for a whole phase holds for ever: the last phase of a sequence goes on after its end, while other
    worlds are at it, and a policy never saw where it is then.
    """
    columns, intervals = [], []
    for config in configs:
        directions, first = synergy_directions(config.action.synergy), config.first_column
        if name == "synergy":
            columns.append([first + directions.index(each) if each in directions else -1 for each in SYNERGIES])
        else:
            first += len(directions)
            columns.append(list(range(first, first + DOF_COUNT)))
        terms = config.action.terms
        interval = terms[name].decision_interval if name in terms else -1
        if interval >= config.most_steps:
            interval = FOR_EVER
        intervals.append(interval if config.decides else 0)
    return columns, intervals


def term_adds_up(configs: Sequence[PhaseConfig], name: str) -> list[int]:
    """For every phase, 1 where later decisions of a term are added to those before, see `latch_actions`."""
    synergies = [config.action.synergy if name == "synergy" else None for config in configs]
    return [int(synergy is not None and synergy.adds_up) for synergy in synergies]
