"""What a motion is generated from: its references, and where its object is to go."""

import math

from artigrasp.references.reference import ReferenceSet, join_references


def choose_references(
    references: ReferenceSet, sequence: str | None, *, split: str, articulation: int, grasp: int
) -> ReferenceSet:
    """The reference that one phase plays, or the two of a sequence in their order.

    Args:
        references: Of the object.
        sequence: One of :data:`artigrasp.tasks.sequences.SEQUENCES`, or None, which plays the articulation alone.
        split: Split of both references.
        articulation: Index among the articulations of that split.
        grasp: Index among its grasps.

    Raises:
        UserError: There is no such reference.
    """
    articulations = references.select(split=split, kind="articulate", indices=articulation)
    if sequence is None:
        return articulations
    grasps = references.select(split=split, kind="grasp", indices=grasp)
    return join_references([grasps, articulations] if sequence.startswith("grasp") else [articulations, grasps])


def target_offset(shift: tuple[float, float, float], yaw: float) -> tuple[float, ...]:
    """From the start to the target of an object: shift [m], and turn about the vertical [rad] as xyzw, shape [7]."""
    return (*shift, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
