"""Which object, references and goal every world of a batch plays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artigrasp.errors import UserError
from artigrasp.references.reference import ReferenceSet

DRAW_GOAL = -1.0
"""Goal angle of a world that draws a new goal at every reset."""


@dataclass(frozen=True)
class WorldPlan:
    """One row per world, worlds of one object side by side; every array has the shape [world]."""

    object_index: NDArray[np.int32]
    """Index of the world's reference set, ascending."""
    first_reference: NDArray[np.int32]
    """First reference that the world draws from, counted over all sets."""
    reference_count: NDArray[np.int32]
    """Number of references that it draws from; one fixes it."""
    goal_angle: NDArray[np.float32]
    """Goal of the hinge angle [rad], or ``DRAW_GOAL``."""
    second_reference: NDArray[np.int32] | None = None
    """Second reference of a sequence's worlds, counted over all sets; None if there is only one."""
    target_offset: NDArray[np.float32] | None = None
    """From the start to the target of the object's base, along the world's axes: shift [m], and turn about the base's
    origin as quaternion xyzw, shape [world, 7]; None if it should stay."""

    @property
    def world_count(self) -> int:
        """Number of worlds."""
        return len(self.object_index)

    def repeat(self, count: int | NDArray[np.integer]) -> "WorldPlan":
        """Every world so many times, a number or one for each, side by side."""
        given = {name: values for name, values in vars(self).items() if values is not None}
        return WorldPlan(**{name: np.repeat(values, count, axis=0) for name, values in given.items()})

    def target_offsets(self) -> NDArray[np.float32]:
        """``target_offset``, or that of bases that stay."""
        if self.target_offset is not None:
            return self.target_offset
        return np.tile(np.array([0, 0, 0, 0, 0, 0, 1], dtype=np.float32), (self.world_count, 1))


def training_worlds(
    references: Sequence[ReferenceSet], world_count: int, *, evenly_of_kinds: bool = False
) -> WorldPlan:
    """Share the worlds evenly between the objects; each draws a reference and a goal at every reset.

    Args:
        references: One set per object.
        world_count: Number of worlds.
        evenly_of_kinds: Whether an object's worlds are shared evenly between the kinds of its references too, however
            many there are of each; those of a kind must then stand side by side.

    Raises:
        UserError: There are fewer worlds than objects, or an object has no references.
    """
    if world_count < len(references):
        raise UserError(f"worlds: expected at least one per object ({len(references)}), found {world_count}")
    counts = _reference_counts(references)
    object_index = np.arange(world_count) * len(references) // world_count
    first, drawn = np.cumsum([0, *counts[:-1]])[object_index], counts[object_index]
    if evenly_of_kinds:
        for index, each in enumerate(references):
            worlds = np.flatnonzero(object_index == index)
            starts = np.flatnonzero(np.r_[True, each.kind[1:] != each.kind[:-1]])
            if len(worlds) >= len(starts):
                share = np.arange(len(worlds)) * len(starts) // len(worlds)
                first[worlds] += starts[share]
                drawn[worlds] = np.diff([*starts, len(each)])[share]
    return WorldPlan(
        object_index.astype(np.int32),
        first.astype(np.int32),
        drawn.astype(np.int32),
        np.full(world_count, DRAW_GOAL, dtype=np.float32),
    )


def trial_worlds(references: Sequence[ReferenceSet], goal_angles: Sequence[float]) -> WorldPlan:
    """One world for every reference and goal, so that one episode measures every trial once.

    Raises:
        UserError: An object has no references.
    """
    counts = _reference_counts(references)
    rows = np.concatenate([np.repeat(np.arange(count), len(goal_angles)) for count in counts])
    objects = np.repeat(np.arange(len(references)), counts * len(goal_angles))
    return planned_worlds(references, objects, rows, np.tile(np.asarray(goal_angles), counts.sum()))


def planned_worlds(
    references: Sequence[ReferenceSet],
    object_index: ArrayLike,
    reference: ArrayLike,
    goal_angle: ArrayLike,
    *,
    second_reference: ArrayLike | None = None,
    target_offset: ArrayLike | None = None,
) -> WorldPlan:
    """One world for every row of a list.

    Args:
        references: One set per object.
        object_index: Index of the reference set of each world, ascending.
        reference: Row of the world's reference in its set.
        goal_angle: Goal of the hinge angle [rad], or ``DRAW_GOAL``, which keeps that of a grasp as it is.
        second_reference: Row of the second reference of a sequence; the first again by default.
        target_offset: See :class:`WorldPlan`; by default objects should stay.
    """
    second_reference = reference if second_reference is None else second_reference
    objects = np.asarray(object_index, dtype=np.int32)
    first = np.cumsum([0, *_reference_counts(references)[:-1]])
    return WorldPlan(
        objects,
        (first[objects] + np.asarray(reference)).astype(np.int32),
        np.ones(len(objects), dtype=np.int32),
        np.broadcast_to(np.asarray(goal_angle, dtype=np.float32), len(objects)),
        (first[objects] + np.asarray(second_reference)).astype(np.int32),
        None if target_offset is None else np.asarray(target_offset, dtype=np.float32),
    )


def _reference_counts(references: Sequence[ReferenceSet]) -> NDArray[np.int64]:
    counts = np.array([len(each.kind) for each in references])
    for each, count in zip(references, counts, strict=True):
        if count == 0:
            raise UserError(f"{each.object}: expected at least one reference of the wanted split and kind, found none")
    return counts
