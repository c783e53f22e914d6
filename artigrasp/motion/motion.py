"""A recorded motion."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array, check_array, check_poses
from artigrasp.config import StageConfig
from artigrasp.kernels.layout import DOF_COUNT, FINGER_DOF_COUNT, HANDS, LINK_COUNT, PARTS


@dataclass(frozen=True)
class MotionReference:
    """The static hand poses that a motion was generated from."""

    part: NDArray[np.int64]
    """Object part that each hand manipulates, index into ``PARTS``, shape ``[H]``."""
    wrist_pose_in_part: NDArray[np.float32]
    """Pose of the wrist link in the frame of that part: position [m], quaternion xyzw, shape ``[H, 7]``."""
    finger_angles: NDArray[np.float32]
    """Finger angles [rad] in the order of ``DOFS``, shape ``[H, 45]``."""


@dataclass(frozen=True)
class MotionBystanders:
    """Further objects of a motion's scene, B of them, which hands may turn to."""

    objects: tuple[str, ...]
    """Their names."""
    pose: NDArray[np.float32]
    """Pose of each base in the world: position [m], quaternion xyzw, shape ``[T, B, 7]``."""
    hinge_angle: NDArray[np.float32]
    """Angle of each hinge [rad], shape ``[T, B]``."""
    focus: NDArray[np.int64]
    """What the hands manipulate and the contact forces are about: 0 the motion's object, 1 the first of these, and so
    on, shape ``[T]``."""


@dataclass(frozen=True)
class Motion:
    """A recorded motion of one or two hands and a hinged object; T samples, H hands.

    Everything is checked on construction: a motion in memory is a valid motion.

    Raises:
        ValueError: A field has another shape than given here, a number that is not finite, a quaternion that is not
            unit, or a name that is unknown. The message starts with the field.
    """

    time: Array
    """Strictly increasing times of the samples [s], shape ``[T]``, T at least 1."""
    hands: tuple[str, ...]
    """Sides of the hands, in the order of ``HANDS``: the hand axis of every array."""
    hand: str
    """Name of the hand model."""
    object: str
    """Name of the object."""
    hand_base: NDArray[np.float32]
    """World frame that the wrist coordinates are relative to: position [m], quaternion xyzw, shape ``[H, 7]``."""
    joint_q: NDArray[np.float32]
    """Joint coordinates [m | rad] in the order of ``DOFS``, shape ``[T, H, 51]``."""
    object_pose: NDArray[np.float32]
    """Pose of the object's base in the world: position [m], quaternion xyzw, shape ``[T, 7]``."""
    hinge_angle: NDArray[np.float32]
    """Angle of the object's hinge [rad], shape ``[T]``."""
    contact_force: NDArray[np.float32]
    """Force on each hand link from each object part [N], in the world, mean over the control step that ends at the
    sample, shape ``[T, H, 16, 2, 3]``."""
    phases: NDArray[np.str_]
    """What the controller was doing, such as ``"grasp"``, shape ``[T]``."""
    target_angle: float
    """Hinge angle to reach [rad]."""
    target_object_pose: NDArray[np.float32] | None = None
    """Pose of the base in the world to reach: position [m], quaternion xyzw, shape ``[7]``; None if it is not known."""
    bystanders: MotionBystanders | None = None
    """The other objects of the scene, if there are any."""
    stage: StageConfig | None = None
    """A plateau on the table, if there is one."""
    reference: MotionReference | None = None
    """The reference that the motion was generated from, if it is known."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    """Metrics of the motion by name."""
    provenance: Mapping[str, str] = field(default_factory=dict)
    """Where the motion came from: task, policy, seed, versions."""

    def __post_init__(self) -> None:
        hands = tuple(self.hands)
        if not hands or hands != tuple(side for side in HANDS if side in hands):
            raise ValueError(f"hands: expected sides out of {HANDS} in this order, found {hands}")
        for name, value in (("hand", self.hand), ("object", self.object)):
            if not isinstance(value, str) or not value:
                raise ValueError(f"{name}: expected a name, found {value!r}")
        sizes = {"H": len(hands)}
        checked: dict[str, Any] = {
            "hands": hands,
            "time": check_array("time", self.time, ("T",), np.float64, sizes),
            "hand_base": check_poses("hand_base", self.hand_base, ("H",), sizes),
            "joint_q": check_array("joint_q", self.joint_q, ("T", "H", DOF_COUNT), np.float32, sizes),
            "object_pose": check_poses("object_pose", self.object_pose, ("T",), sizes),
            "hinge_angle": check_array("hinge_angle", self.hinge_angle, ("T",), np.float32, sizes),
            "contact_force": check_array(
                "contact_force", self.contact_force, ("T", "H", LINK_COUNT, len(PARTS), 3), np.float32, sizes
            ),
            "phases": check_array("phases", self.phases, ("T",), np.str_, sizes),
            "target_angle": float(check_array("target_angle", self.target_angle, (), np.float64)),
            "metrics": _checked_metrics(self.metrics),
            "provenance": _checked_provenance(self.provenance),
        }
        if sizes["T"] == 0:
            raise ValueError("time: expected at least one sample, found none")
        if (np.diff(checked["time"]) <= 0).any():
            raise ValueError("time: expected strictly increasing times, found some that do not increase")
        if self.target_object_pose is not None:
            checked["target_object_pose"] = check_poses("target_object_pose", self.target_object_pose, ())
        if self.bystanders is not None:
            checked["bystanders"] = _checked_bystanders(self.bystanders, sizes)
        if self.reference is not None:
            checked["reference"] = _checked_reference(self.reference, sizes)
        for name, value in checked.items():
            object.__setattr__(self, name, value)


def _checked_reference(reference: MotionReference, sizes: dict[str, int]) -> MotionReference:
    part = check_array("reference_part", reference.part, ("H",), np.int64, sizes)
    if not np.isin(part, range(len(PARTS))).all():
        raise ValueError(f"reference_part: expected 0 to {len(PARTS) - 1}, found {part.tolist()}")
    return MotionReference(
        part=part,
        wrist_pose_in_part=check_poses("reference_wrist_pose_in_part", reference.wrist_pose_in_part, ("H",), sizes),
        finger_angles=check_array(
            "reference_finger_angles", reference.finger_angles, ("H", FINGER_DOF_COUNT), np.float32, sizes
        ),
    )


def _checked_bystanders(bystanders: MotionBystanders, sizes: dict[str, int]) -> MotionBystanders:
    objects = check_array("bystander_objects", bystanders.objects, ("B",), np.str_, sizes).tolist()
    if not objects or "" in objects:
        raise ValueError(f"bystander_objects: expected at least one name and none empty, found {objects}")
    focus = check_array("bystander_focus", bystanders.focus, ("T",), np.int64, sizes)
    if not np.isin(focus, range(1 + len(objects))).all():
        raise ValueError(f"bystander_focus: expected 0 to {len(objects)}, found {np.unique(focus).tolist()}")
    return MotionBystanders(
        objects=tuple(objects),
        pose=check_poses("bystander_pose", bystanders.pose, ("T", "B"), sizes),
        hinge_angle=check_array("bystander_hinge_angle", bystanders.hinge_angle, ("T", "B"), np.float32, sizes),
        focus=focus,
    )


def _checked_metrics(metrics: Mapping[str, float]) -> dict[str, float]:
    for name, value in metrics.items():
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float, np.number))
            or not abs(value) <= sys.float_info.max
        ):
            raise ValueError(f"metrics: {name}: expected a finite number, found {value!r}")
    return {str(name): float(value) for name, value in metrics.items()}


def _checked_provenance(provenance: Mapping[str, str]) -> dict[str, str]:
    for name, value in provenance.items():
        if not isinstance(value, str):
            raise ValueError(f"provenance: {name}: expected a string, found {value!r}")
    return dict(provenance)
