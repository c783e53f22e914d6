"""The batched state that every backend shares with the environment."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from artigrasp.kernels import focus as kernels
from artigrasp.kernels import states


@dataclass(frozen=True)
class SimulationState:
    """Warp arrays of all worlds on the backend's device; see :mod:`artigrasp.kernels.states` for shapes and frames.

    In a scene of several objects, hands manipulate one at a time, the one in *focus*. It is what features, rewards and
    contact forces are about, so that nothing but the physics needs to know how many objects there are.
    """

    hands: states.HandState
    """Hands, and the contact forces of the object in focus on them."""
    objects: states.ObjectState
    """The object in focus of every world; where there is only one, these are views of ``slots``."""
    slots: states.ObjectSlots
    """All objects of every world."""
    focus: wp.array
    """Index of the object that hands manipulate, int, shape [world]; change it by :meth:`set_focus`."""
    diverged: wp.array
    """1 where the physics of a world failed since its last reset and began anew, int, shape [world]."""
    overflow_count: wp.array
    """Substeps since the last reset that dropped contacts or constraints for want of room, int, shape [world]."""

    @property
    def object_count(self) -> int:
        """Objects in each world."""
        return int(self.slots.pose.shape[1])

    def set_focus(self, slot: int, world_mask: wp.array) -> None:
        """Let ``objects`` be others of the scene's objects; contact forces follow with the next step.

        Args:
            slot: Index of the object in its world's scene.
            world_mask: Nonzero where the focus changes, int, shape [world].
        """
        if not 0 <= slot < self.object_count:
            raise ValueError(f"slot: expected 0 to {self.object_count - 1}, found {slot}")
        self._launch(kernels.set_focus, [world_mask, slot, self.focus])
        self.read_focus()

    def read_focus(self) -> None:
        """Take ``objects`` out of ``slots``."""
        if self.object_count > 1:
            self._launch(kernels.read_focus, [self.focus, self.slots, self.objects])

    def write_focus(self, world_mask: wp.array) -> None:
        """Put ``objects`` back into ``slots`` in the worlds whose mask (int, shape [world]) is not zero."""
        if self.object_count > 1:
            self._launch(kernels.write_focus, [world_mask, self.focus, self.objects, self.slots])

    def worlds(self, rows: slice) -> SimulationState:
        """Views of some worlds."""
        return SimulationState(
            hands=states.slice_worlds(states.HandState, self.hands, rows),
            objects=states.slice_worlds(states.ObjectState, self.objects, rows),
            slots=states.slice_worlds(states.ObjectSlots, self.slots, rows),
            focus=self.focus[rows],
            diverged=self.diverged[rows],
            overflow_count=self.overflow_count[rows],
        )

    def _launch(self, kernel: wp.Kernel, inputs: list[object]) -> None:
        wp.launch(kernel, self.focus.shape, inputs=inputs, device=self.focus.device)


def allocate_state(world_count: int, hand_count: int, object_count: int, device: str) -> SimulationState:
    """A zero state; poses must be written before use."""
    slots = states.object_slots(world_count, object_count, device)
    return SimulationState(
        hands=states.hand_state(world_count, hand_count, device),
        objects=states.object_in_slot(slots, 0) if object_count == 1 else states.object_state(world_count, device),
        slots=slots,
        focus=wp.zeros(world_count, dtype=int, device=device),
        diverged=wp.zeros(world_count, dtype=int, device=device),
        overflow_count=wp.zeros(world_count, dtype=int, device=device),
    )
