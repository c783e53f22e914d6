"""What hands may do with an object, and the object as they find it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import ObjectModel
from artigrasp.config.task import Kind, Side
from artigrasp.kernels.layout import ARTICULATED, BASE
from artigrasp.references.reference import load_references

HIGHEST_LEVER_SHARE = 0.99
"""Share of the articulated part's points that are no farther from the hinge than its lever is long."""


@dataclass(frozen=True)
class Grip:
    """A kind of reference: what it is for, and the hands that take part."""

    name: str
    kind: Kind
    sides: tuple[Side, ...]

    @property
    def part(self) -> int:
        """Index of the part that the hands' poses are relative to."""
        return ARTICULATED if self.kind == "articulate" else BASE

    @property
    def mirrored(self) -> str:
        """Name of what the other hand does in the mirror; that of the grip itself if it takes both."""
        names = {"right": "left", "left": "right"}
        return self.name if len(self.sides) == 2 else f"{self.name.rsplit('-', 1)[0]}-{names[self.sides[0]]}"


GRIPS = {
    grip.name: grip
    for grip in (
        Grip("articulate-right", "articulate", ("right",)),
        Grip("articulate-left", "articulate", ("left",)),
        Grip("grasp-both", "grasp", ("left", "right")),
        Grip("grasp-right", "grasp", ("right",)),
        Grip("grasp-left", "grasp", ("left",)),
    )
}
"""All kinds of references by name."""


@dataclass(frozen=True, eq=False)
class RestingObject:
    """An object at rest on the table, closed, in its base's frame.

    Attributes:
        model: The object.
        pose: Frame of the base in the world: position [m], quaternion xyzw, shape (7,).
        angle: Hinge angle [rad].
        up: Unit vector away from the table, shape (3,).
        floor: Height of the table along it [m].
        com: Centre of mass of the whole [m], shape (3,).
        lever: How far from the hinge's axis the articulated part reaches [m].
    """

    model: ObjectModel
    pose: Array
    angle: float
    up: Array
    floor: float
    com: Array
    lever: float

    def opening_direction(self, points: Array) -> tuple[Array, Array]:
        """Where points of the articulated part [..., 3] move as it opens, unit vectors, and their lever arms [m]."""
        axis = self.model.hinge_axis
        offset = points - self.model.hinge_origin
        motion = np.cross(axis, offset)
        arm = np.linalg.norm(motion, axis=-1)
        return motion / np.maximum(arm, 1e-9)[..., None], arm


def usual_pose(object_name: str) -> tuple[Array | None, str | None]:
    """How an object lies on the table in references that there are, and the hand that they are of.

    Returns:
        Of the reference that lies most like the others, the frame of the base in the world, shape (7,), and the name of
        the hand; None and None without references.
    """
    if object_name not in list_assets("references"):
        return None, None
    references = load_references(object_name)
    up = Rotation.from_quat(references.object_pose[:, 3:]).inv().apply([0.0, 0.0, 1.0])
    most = int((up @ up.T).mean(axis=1).argmax())
    return references.object_pose[most].astype(np.float64), references.hand


def rest(model: ObjectModel, pose: Array | None = None) -> RestingObject:
    """Put an object on the table.

    Args:
        model: The object.
        pose: Frame of the base in the world, of which the height does not count; by default upright as in its file.
    """
    angle = float(np.clip(0.0, model.hinge_lower, model.hinge_upper))
    turn = Rotation.from_quat([0.0, 0.0, 0.0, 1.0] if pose is None else pose[3:])
    up = turn.inv().apply([0.0, 0.0, 1.0])
    vertices = model.vertices_in_base(angle)
    floor = float((vertices @ up).min())
    place = np.zeros(3) if pose is None else np.array([*pose[:2], 0.0])
    position, orientation = model.articulated_pose_in_base(angle)
    coms = [model.parts[BASE].com, Rotation.from_quat(orientation).apply(model.parts[ARTICULATED].com) + position]
    masses = [part.mass for part in model.parts]
    arms = np.linalg.norm(np.cross(model.hinge_axis, model.parts[ARTICULATED].vertices - model.hinge_origin), axis=1)
    return RestingObject(
        model=model,
        pose=np.concatenate([place - [0.0, 0.0, floor], turn.as_quat()]),
        angle=angle,
        up=up,
        floor=floor,
        com=np.average(coms, axis=0, weights=masses),
        lever=float(np.quantile(arms, HIGHEST_LEVER_SHARE)),
    )
