"""A range of worlds as the kernels that run on it take it."""

from dataclasses import dataclass

import warp as wp

from artigrasp.kernels import states
from artigrasp.simulation.state import SimulationState


@dataclass(frozen=True)
class WorldRange:
    """Views of the worlds of one of the simulation's ranges, which a thread of its own may step.

    Attributes:
        index: Which of the ranges it is.
        rows: The worlds.
        state: Their physics.
        object_model: What does not change of their objects in focus.
        goal: What is asked of hands and objects.
        phase: Where they are in their sequences.
        step_count: Control steps since their resets.
    """

    index: int
    rows: slice
    state: SimulationState
    object_model: states.ObjectModel
    goal: states.Goal
    phase: states.PhaseState
    step_count: wp.array

    @property
    def every_world(self) -> int:
        """Launch dimension of kernels with a thread per world."""
        return int(self.rows.stop - self.rows.start)

    @property
    def every_hand(self) -> tuple[int, int]:
        """Launch dimension of kernels with a thread per hand."""
        return self.every_world, self.state.hands.joint_q.shape[1]
