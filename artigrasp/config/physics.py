"""Settings of the simulation: time steps, contact and the hands' PD gains."""

from dataclasses import dataclass
from typing import Literal

from artigrasp.config.checks import FieldError, require_not_negative, require_positive


@dataclass(frozen=True)
class PhysicsConfig:
    """Time stepping, contact and constraint solver; printed with every result, for success depends on them."""

    timestep: float = 0.0025
    """Simulation step [s]."""
    substeps: int = 4
    """Simulation steps per control step."""
    friction: float = 3.0
    """Sliding friction coefficient of every contact."""
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    """Shape of the friction cone."""
    impratio: float = 100.0
    """Stiffness of friction relative to the normal constraint: what is held creeps in the fingers the less, the higher
    it is, but the solver then needs its iterations."""
    solref: tuple[float, float] = (0.01, 1.0)
    """Contact time constant [s] and damping ratio."""
    solimp: tuple[float, float, float] = (0.9, 0.99, 0.001)
    """Contact impedance at zero depth, at full depth, and the depth [m] between them."""
    iterations: int = 30
    """Most constraint solver iterations per simulation step; few steps need more than a handful, but a solver that is
    stopped early makes objects creep, jump and fly."""
    ls_iterations: int = 50
    """Most line search iterations per solver iteration."""
    gravity_compensation: bool = True
    """Whether the hands are weightless; the objects never are."""

    def __post_init__(self) -> None:
        require_positive(self, "timestep", "substeps", "impratio", "iterations", "ls_iterations")
        require_not_negative(self, "friction")
        if min(self.solref) <= 0:
            raise FieldError.mismatch("solref", "two positive numbers", self.solref)
        start, end, width = self.solimp
        if not (0 < start <= end < 1 and width > 0):
            raise FieldError.mismatch("solimp", "0 < start <= end < 1 and a positive width", self.solimp)

    @property
    def control_dt(self) -> float:
        """Control step [s]."""
        return self.timestep * self.substeps


@dataclass(frozen=True)
class PDGain:
    """Gains of the torque ``kp (target - q) - kd qd`` of one group of degrees of freedom."""

    kp: float
    """Stiffness [N/m or N.m/rad]."""
    kd: float
    """Damping [N.s/m or N.m.s/rad]; the hand's own passive damping comes on top."""

    def __post_init__(self) -> None:
        require_not_negative(self, "kp", "kd")


@dataclass(frozen=True)
class PDGains:
    """PD gains of a hand's three groups of degrees of freedom (the authors' values)."""

    wrist_translation: PDGain = PDGain(kp=50.0, kd=0.1)
    """The three slides of the wrist."""
    wrist_rotation: PDGain = PDGain(kp=50.0, kd=0.2)
    """The three hinges of the wrist."""
    fingers: PDGain = PDGain(kp=50.0, kd=0.2)
    """The 45 finger hinges."""

    @property
    def groups(self) -> tuple[PDGain, PDGain, PDGain]:
        """All of them, in the order of the kernels' `DOF_GROUPS`."""
        return self.wrist_translation, self.wrist_rotation, self.fingers
