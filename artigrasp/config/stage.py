"""A plateau on the table, from which and onto which objects may be moved."""

from dataclasses import dataclass

from artigrasp.config.checks import FieldError, require_positive


@dataclass(frozen=True)
class StageConfig:
    """A box that stands on the table z = 0 and carries objects; hands pass through it, as they do through the table."""

    height: float
    """Height of its top over the table [m]."""
    size: tuple[float, float]
    """Edge lengths along x and y [m]."""
    position: tuple[float, float] = (0.0, 0.0)
    """Its centre on the table [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "height")
        if min(self.size) <= 0:
            raise FieldError.mismatch("size", "two positive numbers", self.size)
