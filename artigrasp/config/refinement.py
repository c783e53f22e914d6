"""Settings of the refinement of references."""

from dataclasses import dataclass

from artigrasp.config.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class RefinementConfig:
    """What a refined reference weighs against what. A term is a sum of squares of errors over their scales."""

    iterations: int = 200
    """Steps of the optimiser."""
    starts: int = 4
    """Starts of each reference, all but the first one disturbed; the best end counts. More find a way out of walls that
    fingers pierce."""
    seed: int = 0
    """Seed of the disturbances."""
    contact: float = 4.0
    """Weight of the distance of links that should touch from the surface, squared near it and linear far from it."""
    contact_scale: float = 0.005
    """Scale of that distance, and where it becomes linear [m]."""
    penetration: float = 1.0
    """Weight of the depth of the hand's surface in the object."""
    penetration_scale: float = 0.002
    """Scale of that depth [m]."""
    penetration_allowed: float = 0.001
    """Depth that counts as touching [m]."""
    limits: float = 1.0
    """Weight of finger angles beyond the hand's joint limits."""
    limits_scale: float = 0.1
    """Scale of what they exceed the limits by [rad]."""
    natural: float = 0.1
    """Weight of the distance from the finger angles of recorded references, in their standard deviations."""
    stay: float = 0.5
    """Weight of the distance from the pose that the refinement starts with."""
    stay_position: float = 0.01
    """Scale of that distance for the position of the wrist [m]."""
    stay_rotation: float = 0.1
    """Scale of that distance for the rotation of the wrist [rad]."""
    stay_fingers: float = 0.2
    """Scale of that distance for each finger angle [rad]."""

    def __post_init__(self) -> None:
        require_positive(self, "iterations", "starts", "contact_scale", "penetration_scale", "limits_scale")
        require_positive(self, "stay_position", "stay_rotation", "stay_fingers")
        require_not_negative(self, "seed", "contact", "penetration", "penetration_allowed", "limits", "natural", "stay")
