"""A story: several objects on a table, and what hands do with them, step by step."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from artigrasp.config.checks import FieldError, require_not_negative, require_positive
from artigrasp.config.task import Side
from artigrasp.errors import unknown

SideOrBoth = Literal["left", "right", "both"]


@dataclass(frozen=True)
class PlacedObject:
    """An object of the story and where it stands at first."""

    asset: str
    """Object as `artigrasp list objects` names it; it must have references."""
    at: tuple[float, float]
    """Where its base frame stands on the table, along x and y [m]."""
    yaw: float = 0.0
    """Its turn about the vertical [rad]."""
    angle: float = 0.0
    """Its hinge angle [rad]."""


@dataclass(frozen=True, kw_only=True)
class HingeStep:
    """One hand turns the hinge of an object; whether up or back is said by the kinds of it."""

    to: float
    """Hinge angle to reach [rad]."""
    hand: Side | None = None
    """Which hand; by default the one that holds the object, or any that is free."""
    hold: bool = False
    """Whether it stays on the object afterwards, until it closes it, moves it or is released."""
    tolerance: float = 0.2
    """Distance from the angle that counts as there [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "to")
        require_positive(self, "tolerance")


@dataclass(frozen=True, kw_only=True)
class OpenStep(HingeStep):
    """One hand turns the hinge of an object up to an angle."""

    open: str
    """Which object."""

    @property
    def object(self) -> str:
        """The object that it is about."""
        return self.open


@dataclass(frozen=True, kw_only=True)
class CloseStep(HingeStep):
    """One hand turns the hinge of an object back."""

    close: str
    """Which object."""
    to: float = 0.0
    """Hinge angle to reach [rad]."""

    @property
    def object(self) -> str:
        """The object that it is about."""
        return self.close


@dataclass(frozen=True, kw_only=True)
class MoveStep:
    """Hands grasp an object, raise it, carry it over its target, lower it and let go of it."""

    move: str
    """Which object."""
    to: tuple[float, float, float]
    """Where its base frame should be [m]: in the world, or in the base frame of another object."""
    relative_to: str | None = None
    """That other object, where it is when the step begins."""
    roll: float = 0.0
    """Turn of the target about x [rad]: roll, pitch and yaw are about fixed axes, in this order."""
    pitch: float = 0.0
    """Turn of the target about y [rad]."""
    yaw: float = 0.0
    """Turn of the target about z [rad]."""
    hand: SideOrBoth | None = None
    """Which hand; one or both that are free by default."""
    clearance: float = 0.15
    """How high it is carried over where it stood and over its target [m]."""
    drop: float = 0.0
    """Height over its target at which hands let go of it [m]."""
    hold: bool = False
    """Whether hands stay on it afterwards."""
    tolerance: float = 0.05
    """Distance from the target that counts as there [m]."""
    turn_tolerance: float = 0.3
    """Turn from the target that counts as there [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "clearance", "drop")
        require_positive(self, "tolerance", "turn_tolerance")
        if self.drop and self.hold:
            raise FieldError.mismatch("hold", "no hold of what is dropped", self.hold)


@dataclass(frozen=True, kw_only=True)
class ReleaseStep:
    """A hand lets go of what it holds and draws back."""

    release: Side
    """Which hand."""


Step: TypeAlias = OpenStep | CloseStep | MoveStep | ReleaseStep


@dataclass(frozen=True)
class StoryConfig:
    """Objects and what hands do with them, one step after the other, nothing being reset in between."""

    objects: Mapping[str, PlacedObject]
    """The objects by the names that steps call them, in the order of the scene."""
    steps: tuple[Step, ...]
    """What hands do."""
    left_hand: tuple[float, float, float] = (-0.35, -0.35, 0.25)
    """Where the left wrist waits at first [m]."""
    right_hand: tuple[float, float, float] = (0.35, -0.35, 0.25)
    """Where the right wrist waits at first [m]."""

    def __post_init__(self) -> None:
        if not self.objects:
            raise FieldError("objects", "expected at least one, found none")
        if not self.steps:
            raise FieldError("steps", "expected at least one, found none")
        for index, step in enumerate(self.steps):
            for field in ("open", "close", "move", "relative_to"):
                name = getattr(step, field, None)
                if name is not None and name not in self.objects:
                    raise FieldError(f"steps[{index}].{field}", str(unknown("object", name, self.objects)))
                if field == "relative_to" and name is not None and name == getattr(step, "move", None):
                    raise FieldError.mismatch(f"steps[{index}].relative_to", "another object", name)


def describe_step(step: Step) -> str:
    """A step in a few words."""
    match step:
        case OpenStep():
            return f"open {step.open}"
        case CloseStep():
            return f"close {step.close}"
        case MoveStep():
            return f"move {step.move}"
        case ReleaseStep():
            return f"release {step.release}"
