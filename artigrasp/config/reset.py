"""Settings of an episode's start: pre-grasp pose, noise and goal."""

from dataclasses import dataclass

from artigrasp.config.checks import FieldError, require_fraction, require_not_negative


@dataclass(frozen=True)
class ResetConfig:
    """Where hands and goals are when an episode begins."""

    pregrasp_distance: float = 0.10
    """Distance by which a hand starts back from its reference, away from the object's centre [m]."""
    idle_distance: float = 0.30
    """The same for a hand that takes no part [m]."""
    open_fraction: float = 0.3
    """Finger angles at the start, and before the finger prior "reference" closes, as a fraction of the reference's."""
    position_noise: float = 0.02
    """Half width of the uniform noise on each coordinate of the wrist position [m]."""
    angle_noise: float = 0.05
    """Half width of the uniform noise on each wrist rotation and finger angle [rad]."""
    reference_position_noise: float = 0.0
    """Half width of the uniform noise on each coordinate of the reference's wrist position in the part [m]; not in the
    paper. It turns few references into a neighbourhood of each, which helps a policy with unseen ones."""
    reference_rotation_noise: float = 0.0
    """Half width of the uniform noise on the reference's wrist rotation about each axis of the part [rad]."""
    goal_angle: tuple[float, float] = (0.5, 1.5)
    """Range of the uniformly drawn goal of the hinge angle in articulation [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "pregrasp_distance", "idle_distance", "position_noise", "angle_noise")
        require_not_negative(self, "reference_position_noise", "reference_rotation_noise")
        require_fraction(self, "open_fraction")
        low, high = self.goal_angle
        if not 0 <= low <= high:
            raise FieldError.mismatch("goal_angle", "0 <= low <= high", self.goal_angle)
