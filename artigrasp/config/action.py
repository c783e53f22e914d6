"""Settings of the action: joint targets are a prior plus offsets that the policy decides at its own pace."""

from dataclasses import dataclass
from typing import Literal

from artigrasp.config.checks import FieldError, require_not_negative, require_positive


@dataclass(frozen=True)
class SynergyConfig:
    """Slow offsets along a few directions: 3 + 3 of the wrist, 1 + 4 of the fingers, the hinge lead, squeeze, press.

    Each scale is the offset that an action of one stands for; directions whose scale is zero are left out of the
    action.
    """

    wrist_translation: float = 0.015
    """Offset of the wrist per axis, in the manipulated part's frame [m]."""
    wrist_rotation: float = 0.15
    """Rotation of the wrist per axis, in the manipulated part's frame [rad]."""
    finger_flexion: float = 0.3
    """Common flexion of index, middle, ring and pinky [rad]."""
    thumb: float = 0.3
    """Each of the thumb's four angles [rad]."""
    hinge_lead: float = 0.15
    """Change of the hinge-following wrist's lead [rad]."""
    squeeze: float = 0.0
    """Flexion beyond the reference that closed fingers aim at [rad]."""
    press: float = 0.0
    """How far the wrist moves as the fingers close, towards the other hand or, alone, to where its palm looks [m]."""
    decision_interval: int = 300
    """Control steps for which one decision holds; an episode's length makes it one decision per episode."""
    adds_up: bool = False
    """Whether later decisions of an episode are added to those before: zero then holds on to them."""

    def __post_init__(self) -> None:
        scales = ("wrist_translation", "wrist_rotation", "finger_flexion", "thumb", "hinge_lead", "squeeze", "press")
        require_not_negative(self, *scales)
        require_positive(self, "decision_interval")


@dataclass(frozen=True)
class ResidualConfig:
    """Fast offsets of all 51 joint targets; each scale is the offset that an action of one stands for (the paper's)."""

    wrist_translation: float = 0.001
    """Offset of each wrist slide [m]."""
    wrist_rotation: float = 0.01
    """Offset of each wrist hinge [rad]."""
    fingers: float = 0.015
    """Offset of each finger angle [rad]."""
    decision_interval: int = 1
    """Control steps for which one decision holds."""

    def __post_init__(self) -> None:
        require_not_negative(self, "wrist_translation", "wrist_rotation", "fingers")
        require_positive(self, "decision_interval")


@dataclass(frozen=True)
class ActionConfig:
    """How an action becomes joint targets: a prior plus the terms that are not None.

    The defaults are the paper's: the wrist at the reference on the moving part, the fingers where they are, and a
    residual on top.
    """

    wrist_prior: Literal["reference", "hinge", "schedule", "transport", "retreat", "transit", "home"] = "reference"
    """Where the wrist goes by itself: to the reference on the manipulated part as it is now; to the reference on
    the part turned ahead about the hinge toward the goal; to the reference on the part turned with time from the start
    to the goal, wherever it is; along with the object that it carries to its target; away
    from the object; around the object to where its reference is approached from; up and over to where the hand waited
    at first, of which only episodes know that begin at an instant (:meth:`Environment.begin_at`)."""
    finger_prior: Literal["current", "reference", "closed", "opening"] = "current"
    """Where the fingers go by themselves: they stay as they are, close to the reference, stay there, or open again."""
    synergy: SynergyConfig | None = None
    """Slow offsets along a few directions."""
    residual: ResidualConfig | None = ResidualConfig()
    """Fast offsets of every joint."""
    hinge_lead: float = 0.3
    """Angle by which the wrist prior "hinge" runs ahead of the part, at most [rad]."""
    lead_start: int = 70
    """Control step at which the wrist prior "hinge" begins to run ahead of the part, and "schedule" to turn it."""
    lead_end: int = 120
    """Control step from which it runs ahead by the full lead, or has turned the part to the goal."""
    approach_steps: int = 0
    """Control steps over which the wrist priors "hinge", "schedule", "retreat", "transit" and "home" move from the
    initial pose to their goal; 0 aims there at once."""
    approach_arc: float = 0.0
    """How far the way of the wrist priors "hinge" and "schedule" bows to the hand's back and wrist, so that it comes in
    with palm and fingertips [m]."""
    close_start: int = 30
    """Control step at which the finger priors begin to close or open."""
    close_end: int = 70
    """Control step at which they have closed or opened."""
    squeeze: float = 0.0
    """Flexion beyond the reference that closed fingers aim at, which presses them on the object [rad]."""
    press: float = 0.0
    """How far the wrists move onto the object as the fingers close [m]: towards each other if both hands take part,
    else to where the palm looks."""
    follow: float = 1.0
    """Share of what the object has moved away from where it should be that the references of the wrist priors "hinge"
    and "schedule" move along; with 0 hands do not run after an object that they push."""
    carry_speed: float = 0.2
    """Mean speed at which the wrist prior "transport" carries the object [m/s]."""
    carry_turn_speed: float = 0.4
    """Mean speed at which it turns the object [rad/s]."""
    carry_feedback: float = 0.0
    """Share of what the object lags behind its planned pose by which it moves and turns the wrists on."""
    retreat_distance: float = 0.15
    """Distance by which the wrist prior "retreat" backs off [m]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "hinge_lead", "lead_start", "approach_steps", "close_start")
        require_not_negative(self, "squeeze", "press", "approach_arc", "follow", "carry_feedback", "retreat_distance")
        require_positive(self, "carry_speed", "carry_turn_speed")
        for name in ("close", "lead"):
            start, end = getattr(self, f"{name}_start"), getattr(self, f"{name}_end")
            if end < start:
                raise FieldError.mismatch(f"{name}_end", f"at least {name}_start ({start})", end)
        if self.terms:
            slowest = max(self.terms, key=lambda name: self.terms[name].decision_interval)
            interval, shortest = self.terms[slowest].decision_interval, self.decision_interval
            if interval % shortest != 0:
                expected = f"a multiple of the other term's ({shortest})"
                raise FieldError.mismatch(f"{slowest}.decision_interval", expected, interval)

    @property
    def terms(self) -> dict[str, SynergyConfig | ResidualConfig]:
        """The terms in use by their name, in the order of their columns in the action."""
        terms = {"synergy": self.synergy, "residual": self.residual}
        return {name: term for name, term in terms.items() if term is not None}

    @property
    def decision_interval(self) -> int:
        """Control steps between two decisions of the policy: the shortest interval of the terms in use.

        Raises:
            FieldError: No term is in use, so that there is nothing to decide.
        """
        if not self.terms:
            raise FieldError("synergy", "expected a synergy or a residual term for a policy to decide, found neither")
        return min(term.decision_interval for term in self.terms.values())
