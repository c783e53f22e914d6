"""References from labelled frames of ARCTIC."""

from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import Array
from artigrasp.assets.arctic import HAND_NAME
from artigrasp.assets.object import ObjectModel
from artigrasp.errors import UserError, unknown
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS
from artigrasp.references.arctic_labels import LabelledFrame
from artigrasp.references.mano_pose import finger_angles, wrist_pose
from artigrasp.references.poses import to_poses
from artigrasp.references.reference import ReferenceSet

TASKS = {
    "right_arti": ("articulate", ("right",)),
    "right_grasp": ("grasp", ("right",)),
    "left_grasp": ("grasp", ("left",)),
    "two_grasp": ("grasp", ("left", "right")),
    "left_arti": ("articulate", ("left",)),
    "two_arti": ("articulate", ("left", "right")),
}
"""Kind and active hands of each of the authors' kinds of label; their splits have none of the last two."""

NEVER_CLOSED = ("ketchup", "phone")
"""Objects that start at the hinge angle of the initial frame; all others start closed."""
CONTACT_WITH_ARTICULATED, CONTACT_WITH_EITHER = 0, 2
"""Rows of a frame's contacts; the one between is the base."""


def make_references(model: ObjectModel, frames: list[LabelledFrame], mean_pose: dict[str, Array]) -> ReferenceSet:
    """The references of an object that labelled frames show, in their order.

    Args:
        model: The object.
        frames: At least one labelled frame of it.
        mean_pose: MANO's mean pose of each side, shape (45,) [rad].

    Raises:
        UserError: a label is of an unknown kind, or the numbers make no pose.
    """
    rows = [_make_reference(model, frame, mean_pose) for frame in frames]
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    try:
        return ReferenceSet(object=model.name, hand=HAND_NAME, **columns)
    except ValueError as error:
        raise UserError(f"{model.name}: {error}") from None


def _make_reference(model: ObjectModel, frame: LabelledFrame, mean_pose: dict[str, Array]) -> dict[str, Any]:
    label = frame.label
    if label.task not in TASKS:
        raise unknown("kind of label", label.task, TASKS)
    kind, sides = TASKS[label.task]
    base, angle = base_pose(frame.state), float(frame.state[0])
    position, orientation = model.articulated_pose_in_base(angle)
    opened = RigidTransform.from_components(position, Rotation.from_quat(orientation))
    part_pose = {BASE: base, ARTICULATED: base * opened}
    part = [ARTICULATED if kind == "articulate" and side in sides else BASE for side in HANDS]
    wrists = [
        part_pose[part[hand]].inv() * wrist_pose(frame.rotation[hand], frame.translation[hand], side)
        for hand, side in enumerate(HANDS)
    ]
    angles = [finger_angles(frame.pose[hand] + mean_pose[side]) for hand, side in enumerate(HANDS)]
    row = CONTACT_WITH_ARTICULATED if kind == "articulate" else CONTACT_WITH_EITHER
    initial_angle = 0.0
    if model.name in NEVER_CLOSED:
        initial_angle = float(np.clip(frame.initial_state[0], model.hinge_lower, model.hinge_upper))
    subject, sequence, _ = label.recording
    return {
        "kind": kind,
        "split": label.split,
        "active": [side in sides for side in HANDS],
        "part": part,
        "wrist_pose_in_part": [to_poses(wrist) for wrist in wrists],
        "finger_angles": angles,
        "contacts": [frame.contacts[hand, row] & (side in sides) for hand, side in enumerate(HANDS)],
        "object_pose": to_poses(resting_pose(model, Rotation.from_rotvec(frame.initial_state[1:4]), initial_angle)),
        "object_angle": initial_angle,
        "source": f"{sequence} {subject} init {label.initial_frame} grasp {label.frame}",
        "subject": subject,
        "sequence": sequence,
        "frame": label.frame,
    }


def resting_pose(model: ObjectModel, rotation: Rotation, angle: float) -> RigidTransform:
    """The base's pose with this rotation whose lowest vertex is at z = 0 and whose centre of mass is at x = y = 0."""
    lowest = rotation.apply(model.vertices_in_base(angle))[:, 2].min()
    centre = rotation.apply(model.parts[BASE].com)
    return RigidTransform.from_components([-centre[0], -centre[1], -lowest], rotation)


def base_pose(state: Array) -> RigidTransform:
    """Frames of the base from ARCTIC's angle, rotation vector [rad] and translation [mm], shape (..., 7)."""
    return RigidTransform.from_components(state[..., 4:7] / 1000, Rotation.from_rotvec(state[..., 1:4]))
