"""References from ARCTIC's motion capture, as the authors labelled it.

The paper takes hand poses from frames in which hands hold or open the object. The authors' labels name such a
``grasp_frame``, and an ``init_frame`` whose object pose starts the task.
"""

import logging
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import check_array
from artigrasp.assets import arctic as assets
from artigrasp.assets.object import ObjectModel
from artigrasp.errors import UserError, unknown
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS, LINK_COUNT
from artigrasp.references.reference import ReferenceSet

logger = logging.getLogger(__name__)

Array = NDArray[np.float64]

LABELS = "labelled_frames.npz"

WRIST_FROM_MANO = {"right": np.array([0.09566994, 0.00638343, 0.0061863])}
WRIST_FROM_MANO["left"] = WRIST_FROM_MANO["right"] * [-1, 1, 1]
"""MANO's wrist joint for the mean shape, about which a hand turns, from MANO's translation [m]."""

TASKS = {
    "right_arti": ("articulate", ("right",)),
    "right_grasp": ("grasp", ("right",)),
    "left_grasp": ("grasp", ("left",)),
    "two_grasp": ("grasp", ("left", "right")),
}
"""Kind and active hands of each of the authors' kinds of label."""

NEVER_CLOSED = ("ketchup", "phone")
"""Objects that start at the hinge angle of ``init_frame``; all others start closed."""
CONTACT_WITH_ARTICULATED, CONTACT_WITH_EITHER = 0, 2
"""Rows of the labels' contacts; the one between is the base."""

CAMERA_SPLIT = "recon"
"""Poses reconstructed from images: hands and object are in the frame of the camera, so that up is unknown."""

_FIELDS: dict[str, tuple[tuple[int | str, ...], Any]] = {
    **dict.fromkeys(("split", "subject", "sequence", "object", "kind"), (("N",), np.str_)),
    **dict.fromkeys(("init_frame", "grasp_frame"), (("N",), np.int64)),
    **dict.fromkeys(("object_init", "object_grasp"), (("N", 7), np.float64)),
    **{f"{side}_{name}": (("N", size), np.float64) for side in HANDS for name, size in (("rot", 3), ("trans", 3))},
    **{f"{side}_pose": (("N", 45), np.float64) for side in HANDS},
    **{f"{side}_contact": (("N", 3, LINK_COUNT), np.int64) for side in HANDS},
}


def read_labels(source: Path) -> dict[str, NDArray[Any]]:
    """The labelled frames of every object and split, N rows each.

    Raises:
        UserError: the file is missing or malformed; names the field and the index.
    """
    path = source / LABELS
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in _FIELDS}
        sizes: dict[str, int] = {}
        return {name: check_array(name, arrays[name], *_FIELDS[name], sizes) for name in _FIELDS}
    except FileNotFoundError:
        raise UserError(f"{path}: expected the labelled frames, found nothing") from None
    except KeyError as error:
        raise UserError(f"{path}: expected an array {error}, found none") from None
    except Exception as error:  # A damaged archive can fail anywhere in NumPy, zipfile or zlib.
        raise UserError(f"{path}: {(str(error) or repr(error)).splitlines()[0]}") from error


def read_mean_pose(source: Path, side: str) -> Array:
    """MANO's mean hand pose, which the labels' poses leave out: rotation vectors [rad], shape (45,)."""
    path = mean_pose_path(source, side)
    try:
        values = [float(word) for word in path.read_text().split()]
        return check_array("mean pose", values, (45,), np.float64)
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: expected 45 numbers: {error}") from None


def convert_references(
    source: Path, model: ObjectModel, labels: dict[str, NDArray[Any]], mean_pose: dict[str, Array]
) -> tuple[ReferenceSet, list[str]]:
    """The references of an object from its labels.

    Args:
        source: The release, for the sequences that the image references need.
        model: The object.
        labels: From :func:`read_labels`.
        mean_pose: From :func:`read_mean_pose`, per side.

    Returns:
        The references, and a line for each label that gave none.

    Raises:
        UserError: the object has no labels.
    """
    rows: list[dict[str, Any]] = []
    skipped: list[str] = []
    for index in np.flatnonzero(labels["object"] == model.name):
        label = {name: values[index] for name, values in labels.items()}
        try:
            rows.append(_convert_label(source, model, label, mean_pose))
        except UserError as error:
            skipped.append(f"{_provenance(label)}: {error}")
            logger.warning("no reference from %s", skipped[-1])
    if not rows:
        raise UserError(f"{source / LABELS}: expected labels of {model.name!r}, found none that can be used")
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return ReferenceSet(object=model.name, hand=assets.HAND_NAME, **columns), skipped


def _convert_label(
    source: Path, model: ObjectModel, label: dict[str, Any], mean_pose: dict[str, Array]
) -> dict[str, Any]:
    if label["kind"] not in TASKS:
        raise unknown("kind", label["kind"], TASKS)
    kind, sides = TASKS[label["kind"]]
    base, angle = _object_state(label["object_grasp"])
    part_pose = {BASE: base, ARTICULATED: base * _transform(*model.articulated_pose_in_base(angle))}
    part = [ARTICULATED if kind == "articulate" and side in sides else BASE for side in HANDS]
    wrists = [part_pose[p].inv() * _wrist_pose(label, side) for side, p in zip(HANDS, part, strict=True)]
    angles = [_finger_angles(label[f"{side}_pose"] + mean_pose[side]) for side in HANDS]
    row = CONTACT_WITH_ARTICULATED if kind == "articulate" else CONTACT_WITH_EITHER
    contacts = [label[f"{side}_contact"][row] * (side in sides) for side in HANDS]

    initial = label["object_init"]
    if label["split"] == CAMERA_SPLIT:
        initial = _mocap_object(source, label)
    initial_angle = 0.0
    if model.name in NEVER_CLOSED:
        initial_angle = float(np.clip(initial[0], model.hinge_lower, model.hinge_upper))
    return {
        "kind": kind,
        "split": label["split"],
        "active": [side in sides for side in HANDS],
        "part": part,
        "wrist_pose_in_part": [_pose(wrist) for wrist in wrists],
        "finger_angles": angles,
        "contacts": np.array(contacts, bool),
        "object_pose": _pose(resting_pose(model, Rotation.from_rotvec(initial[1:4]), initial_angle)),
        "object_angle": initial_angle,
        "source": _provenance(label),
    }


def resting_pose(model: ObjectModel, rotation: Rotation, angle: float) -> RigidTransform:
    """The base's pose with this rotation whose lowest vertex is at z = 0 and whose centre of mass is at x = y = 0."""
    lowest = rotation.apply(model.vertices_in_base(angle))[:, 2].min()
    centre = rotation.apply(model.parts[BASE].com)
    return RigidTransform.from_components([-centre[0], -centre[1], -lowest], rotation)


def _wrist_pose(label: dict[str, Any], side: str) -> RigidTransform:
    position = label[f"{side}_trans"] + WRIST_FROM_MANO[side]
    return RigidTransform.from_components(position, Rotation.from_rotvec(label[f"{side}_rot"]))


def _finger_angles(rotation_vectors: Array) -> Array:
    angles: Array = Rotation.from_rotvec(rotation_vectors.reshape(-1, 3)).as_euler("XYZ").ravel()
    return angles


def _object_state(state: Array) -> tuple[RigidTransform, float]:
    """Pose of the base and hinge angle [rad] from ARCTIC's angle, rotation vector and translation [mm]."""
    return RigidTransform.from_components(state[4:7] / 1000, Rotation.from_rotvec(state[1:4])), float(state[0])


def _mocap_object(source: Path, label: dict[str, Any]) -> Array:
    """The object's state at ``init_frame`` in the motion capture of the sequence that the images show."""
    path = assets.object_folder(source, label["object"]) / label["subject"] / f"{label['sequence']}.object.npy"
    try:
        states = check_array("states", np.load(path, allow_pickle=False), ("T", 7), np.float64)
        state: Array = states[label["init_frame"]]
    except FileNotFoundError:
        raise UserError(f"{path}: expected the sequence that gives the object's pose, found nothing") from None
    except (OSError, ValueError, IndexError) as error:
        raise UserError(f"{path}: {error}") from None
    return state


def _transform(position: Array, orientation: Array) -> RigidTransform:
    return RigidTransform.from_components(position, Rotation.from_quat(orientation))


def _pose(transform: RigidTransform) -> Array:
    position, rotation = transform.as_components()
    return np.concatenate([position, rotation.as_quat(canonical=True)])


def _provenance(label: dict[str, Any]) -> str:
    return f"{label['sequence']} {label['subject']} init {label['init_frame']} grasp {label['grasp_frame']}"


def mean_pose_path(source: Path, side: str) -> Path:
    """The file of MANO's mean hand pose in the release."""
    return source / "rsc" / "mano_double" / f"{side}_pose_mean.txt"
