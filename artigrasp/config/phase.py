"""Settings of a phase: a long motion is a sequence of them (paper, Section Sequence Generation)."""

from dataclasses import dataclass
from typing import Literal

from artigrasp.config.action import ActionConfig
from artigrasp.config.checks import FieldError, require_not_negative, require_positive
from artigrasp.config.physics import PDGains


@dataclass(frozen=True)
class PhaseConfig:
    """One phase: what hands do, to what end, and what comes of a failure."""

    name: str
    """What a motion shows and a report names, such as "grasp"."""
    most_steps: int
    """Control steps after which the phase ends in any case."""
    least_steps: int = 0
    """Control steps before which it does not end, except by a failure."""
    aim: Literal["time", "grasp", "object", "hinge", "hands"] = "time"
    """What ends it early: nothing; all hands that take part touch the object, which is at rest; the object is at its
    target; the hinge is; the wrists have arrived."""
    skill: Literal["articulate", "grasp"] | None = None
    """What a policy must have learned to act in this phase; None for phases that need none."""
    reference: Literal["first", "second"] = "first"
    """Which of a world's two references is played."""
    carries: bool = False
    """Whether the hands take the object to its target; else it should stay."""
    lift: float = 0.0
    """Height over the target to which the object is carried [m]."""
    raises: bool = False
    """Whether it is carried so high over where the phase began instead."""
    places: bool = False
    """Whether it fails if the object is not at its target in the end."""
    drops: bool = False
    """Whether the object falls as hands let go of it, and may turn over; else that is a failure, unless they
    carry it."""
    steadies: bool = False
    """Whether hands that take no part hold the base where their reference has them on it; else they wait."""
    opens: bool = True
    """Whether the hinge should go to its target; else it should stay as it was at the start."""
    decides: bool = True
    """Whether a policy decides in this phase; else what was decided before goes on holding."""
    retry_from: str | None = None
    """Phase to go back to after a failure, while there are tries left; without one the next phase follows. Where the
    object is carried, hands go back only for one that they have dropped."""
    first_column: int = 0
    """Where what is decided for the phase begins in the controller's action."""
    action: ActionConfig = ActionConfig(residual=None)
    """Priors, and what a policy decides."""
    gains: PDGains = PDGains()
    """PD gains of the hands."""

    def __post_init__(self) -> None:
        require_positive(self, "most_steps")
        require_not_negative(self, "least_steps", "lift", "first_column")
        if self.least_steps > self.most_steps:
            raise FieldError.mismatch("least_steps", f"at most most_steps ({self.most_steps})", self.least_steps)
