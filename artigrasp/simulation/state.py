"""The batched state that every backend shares with the environment."""

from dataclasses import dataclass

import warp as wp

from artigrasp.kernels import states


@dataclass(frozen=True)
class SimulationState:
    """Warp arrays of all worlds on the backend's device; see :mod:`artigrasp.kernels.states` for shapes and frames."""

    hands: states.HandState
    objects: states.ObjectState
    diverged: wp.array
    """1 where the physics of a world failed since its last reset, int, shape [world]."""


def allocate_state(world_count: int, hand_count: int, device: str) -> SimulationState:
    """A zero state; poses must be written before use."""
    return SimulationState(
        hands=states.hand_state(world_count, hand_count, device),
        objects=states.object_state(world_count, device),
        diverged=wp.zeros(world_count, dtype=int, device=device),
    )
