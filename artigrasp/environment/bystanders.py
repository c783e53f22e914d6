"""Objects that stand by while hands manipulate another, and the change from one to the next."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.arrays import Array
from artigrasp.assets.object import ObjectModel
from artigrasp.environment import tables
from artigrasp.environment.worlds import WorldPlan
from artigrasp.kernels import focus, states
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.state import SimulationState

DEFAULT_DISTANCE = 1.0
"""Of bystanders from each other and from the origin along x, until they are placed [m]."""


class Bystanders:
    """The objects in slots 1, 2, ... of every world, and which of a world's objects is in focus.

    Attributes:
        object_model: What does not change of the object in focus, [W].
        object_mass: Mass that caps the rewarded force on it [kg], [W].
    """

    def __init__(
        self,
        objects: Sequence[ObjectModel],
        bystanders: Sequence[ObjectModel],
        references: Sequence[ReferenceSet],
        worlds: WorldPlan,
        fixed_base: bool,
        state: SimulationState,
        goal: states.Goal,
    ) -> None:
        """Place every bystander on the table, apart from the others.

        Args:
            objects: The objects of slot 0, of which each world has one.
            bystanders: The objects of the other slots, which all worlds have.
            references: A set for each bystander; it stands as in the first.
            worlds: Which of ``objects`` each world has.
            fixed_base: Whether bases are fixed.
            state: Where objects are.
            goal: Where the start of the object in focus is kept.
        """
        self._state, self._goal, device = state, goal, state.focus.device
        everywhere = replace(worlds, object_index=np.zeros_like(worlds.object_index))
        choices = [(objects, worlds), *(([each], everywhere) for each in bystanders)]
        self._models = [tables.object_table(*choice, device) for choice in choices]
        self._masses = [tables.object_mass(*choice, fixed_base, device) for choice in choices]
        self.object_model, self.object_mass = self._models[0], self._masses[0]
        if bystanders:
            self.object_model = states.object_model(worlds.world_count, device)
            self.object_mass = wp.zeros_like(self._masses[0])
        self._places = states.object_slots(worlds.world_count, 1 + len(bystanders), device)
        for slot, each in enumerate(references, start=1):
            pose = each.object_pose[0].copy()
            pose[:2] = slot * DEFAULT_DISTANCE, 0.0
            self.place(slot, pose, each.object_angle[0])

    def place(self, slot: int, pose: ArrayLike, angle: ArrayLike = 0.0) -> None:
        """Say where a bystander stands from the next reset on.

        Args:
            slot: Which one, counted from 1.
            pose: Frame of its base in the world, position [m] and xyzw, shape [7] or [world, 7].
            angle: Its hinge angle [rad], a number or of shape [world].
        """
        if not 0 < slot <= len(self._models) - 1:
            raise ValueError(f"slot: expected 1 to {len(self._models) - 1}, found {slot}")
        for array, values in ((self._places.pose, pose), (self._places.hinge_q, angle)):
            rows = array.numpy()
            rows[:, slot] = values
            array.assign(rows)

    def place_all(self, values: Mapping[str, NDArray[np.float32]]) -> None:
        """Say where all objects are from the next reset on, and how they move.

        Args:
            values: Fields of ``ObjectSlots``, each of shape [object, ...].
        """
        for name, rows in values.items():
            array = getattr(self._places, name)
            array.assign(np.broadcast_to(rows, (len(array), *rows.shape)))

    def place_like(self, other: "Bystanders", count: int | NDArray[np.integer]) -> None:
        """Places for so many copies of every world of ``other``, side by side."""
        for name in states.element_types(states.ObjectSlots):
            getattr(self._places, name).assign(np.repeat(getattr(other._places, name).numpy(), count, axis=0))

    def reset(self, world_mask: wp.array) -> None:
        """Put the bystanders in their places and slot 0 into focus where the mask (int, [W]) is not zero."""
        if self._state.object_count > 1:
            self.put_in_place(world_mask)

    def put_in_place(self, world_mask: wp.array) -> None:
        """Put all objects in their places, also that in slot 0, and this one into focus."""
        wp.launch(
            focus.place_objects,
            world_mask.shape,
            inputs=[world_mask, self._places, self._state.slots],
            device=world_mask.device,
        )
        self.set_focus(0, world_mask)

    def disturbance(self) -> dict[str, Array]:
        """How far bystanders are from their places now, the farthest of each world: [m] and [rad], of shape [world].

        The turn is that of the base or of the hinge, whichever is more.
        """
        now, places = self._state.slots, self._places
        pose, place = (each.pose.numpy()[:, 1:].astype(np.float64) for each in (now, places))
        cosine = np.clip(np.abs((pose[..., 3:] * place[..., 3:]).sum(axis=2)), 0.0, 1.0)
        hinge = np.abs(now.hinge_q.numpy() - places.hinge_q.numpy())[:, 1:]
        return {
            "bystander_shift": np.linalg.norm(pose[..., :3] - place[..., :3], axis=2).max(axis=1),
            "bystander_turn": np.maximum(2.0 * np.arccos(cosine), hinge).max(axis=1),
        }

    def set_focus(self, slot: int, world_mask: wp.array) -> None:
        """Let the hands of the masked worlds manipulate another object; see :meth:`Environment.set_focus`."""
        self._state.set_focus(slot, world_mask)
        wp.launch(
            focus.describe_focus,
            world_mask.shape,
            inputs=[world_mask, slot, self._models[slot], self._masses[slot], self._state.slots],
            outputs=[self.object_model, self.object_mass, self._goal],
            device=world_mask.device,
        )
