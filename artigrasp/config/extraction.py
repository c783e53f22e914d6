"""Settings of the extraction of references from recordings."""

from dataclasses import dataclass

from artigrasp.config.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class ExtractionConfig:
    """When a recording shows an interaction. The numbers were chosen on the labels of ARCTIC's subject s1."""

    base_speed: float = 0.1
    """A base faster than this moves, the paper's ε_v: root mean square over its surface [m/s]."""
    hinge_rate: float = 0.5
    """A hinge faster than this changes its angle [rad/s]."""
    hinge_change: float = 0.2
    """Least change of the hinge angle in an articulation [rad]."""
    surface_height: float = 0.02
    """A grasp begins with the object no higher than this above the surface that it lay on [m]."""
    holding_links: int = 3
    """So many links of a hand that touch the object hold it."""
    turning_links: int = 2
    """So many links of a hand that touch the articulated part turn it."""
    contact_distance: float = 0.008
    """Where contacts are measured: a link touches what is nearer than this [m]."""
    contact_time: float = 0.17
    """Contacts that last less long are left out, interruptions that last no longer are bridged [s]."""
    pause: float = 0.5
    """A longer standstill ends an interaction [s]."""
    duration: float = 0.33
    """Least time of movement in an interaction [s]."""
    delay: float = 0.25
    """Time from the beginning of an interaction to the frame that stands for it [s]."""
    smoothing: float = 0.05
    """Standard deviation of the Gaussian that smooths positions and angles over time [s]."""
    held_grasps: bool = False
    """Take also the grasp of a hand that holds the object in the air while the other one opens it."""

    def __post_init__(self) -> None:
        require_positive(self, "base_speed", "hinge_rate", "surface_height", "holding_links", "turning_links")
        require_not_negative(self, "hinge_change", "contact_time", "pause", "duration", "delay", "smoothing")
