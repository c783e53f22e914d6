"""ARCTIC's recordings of hands and objects, from the official download or the authors' release.

They are recorded at 30 frames per second. The release adds contacts, and reconstructions from images of the recordings
of one subject, frame by frame, in the frame of the camera.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array, check_array
from artigrasp.assets.arctic import ArcticSource
from artigrasp.errors import UserError
from artigrasp.kernels.layout import FINGER_DOF_COUNT, HANDS, LINK_COUNT
from artigrasp.restricted_pickle import read_npy

CLASSES = ("common.xdict.xdict",)
"""What the release's reconstructions are made of besides dictionaries and arrays."""
CONTACT_ROWS = 3
"""Contacts with the articulated part, with the base and with either."""

_SUBJECT, _SEQUENCE = re.compile(r"s[1-9][0-9]?"), re.compile(r"([a-z]+)_[A-Za-z0-9_]+")


class Recording(NamedTuple):
    """What names a recording.

    Attributes:
        subject: Who was recorded, ``"s1"`` to ``"s10"``.
        sequence: Name of the recording, which starts with that of the object, such as ``"box_use_02"``.
        reconstructed: Whether it is the reconstruction from images.
    """

    subject: str
    sequence: str
    reconstructed: bool = False


@dataclass(frozen=True, eq=False)
class RecordedSequence:
    """A recording of T frames, as ARCTIC gives it; hands in the order of ``HANDS``.

    Attributes:
        rotation: Rotation vectors of the wrists [rad], shape (T, 2, 3).
        pose: Rotation vectors of the finger joints without MANO's mean pose [rad], shape (T, 2, 45).
        translation: MANO's translations [m], shape (T, 2, 3).
        object_state: Hinge angle [rad], rotation vector [rad] and translation **[mm]**, shape (T, 7).
        contacts: Which links touch the articulated part, the base or either, shape (T, 2, 3, 16), where that is known.
    """

    rotation: Array
    pose: Array
    translation: Array
    object_state: Array
    contacts: NDArray[np.bool_] | None


def check_name(recording: Recording, object_name: str) -> None:
    """Refuse names that could lead to other files.

    Raises:
        ValueError: the subject or the sequence is not named as ARCTIC's are.
    """
    if not _SUBJECT.fullmatch(recording.subject):
        raise ValueError(f"expected a subject s1 to s99, found {recording.subject!r}")
    found = _SEQUENCE.fullmatch(recording.sequence)
    if found is None or found[1] != object_name:
        raise ValueError(f"expected a sequence of the object {object_name!r}, found {recording.sequence!r}")


def sequence_files(source: ArcticSource, recording: Recording) -> list[Path]:
    """The files of a recording: hands, object and, in the release, contacts of each hand; empty if it is not there."""
    subject, sequence, reconstructed = recording
    if source.release is not None:
        folder = f"{subject}_recon" if reconstructed else subject
        mano = source.release / "mano_double"
        contacts = mano / ("contact_recon" if reconstructed else "contact") / subject
        object_file = source.release / "arctic" / sequence.split("_")[0] / folder / f"{sequence}.object.npy"
        files = [mano / folder / f"{sequence}.mano.npy", object_file]
        if all(path.is_file() for path in files):
            return files + [path for side in HANDS if (path := contacts / f"{sequence}_a_{side[0]}.npy").is_file()]
    if source.download is not None and not reconstructed:
        folder_path = source.download / "raw_seqs" / f"s{int(subject[1:]):02d}"
        files = [folder_path / f"{sequence}.mano.npy", folder_path / f"{sequence}.object.npy"]
        if all(path.is_file() for path in files):
            return files
    return []


def find_recordings(source: ArcticSource, object_name: str, *, reconstructed: bool = False) -> list[Recording]:
    """The recordings of an object of which both hands and object are there, by subject and name.

    Args:
        source: The user's copy.
        object_name: Name of the object.
        reconstructed: Find the reconstructions from images instead.
    """
    folders = {
        source.release: f"mano_double/s*{'_recon' if reconstructed else '[0-9]'}",
        source.download: "raw_seqs/s[0-9][0-9]",
    }
    found = set()
    for root, folder in folders.items():
        for path in root.glob(f"{folder}/{object_name}_*.mano.npy") if root is not None else ():
            number = path.parent.name.removesuffix("_recon")[1:]
            recording = Recording(f"s{int(number)}" if number.isdigit() else "", path.name.split(".")[0], reconstructed)
            try:
                check_name(recording, object_name)
            except ValueError:
                continue
            if sequence_files(source, recording):
                found.add(recording)
    return sorted(found, key=lambda each: (int(each.subject[1:]), each.sequence))


def object_sequence_files(source: ArcticSource, object_name: str) -> list[Path]:
    """The files of all recordings of an object, sorted."""
    patterns = {
        source.release: (f"arctic/{object_name}/*/*.npy", f"mano_double/**/{object_name}_*.npy"),
        source.download: (f"raw_seqs/*/{object_name}_*.mano.npy", f"raw_seqs/*/{object_name}_*.object.npy"),
    }
    return sorted(
        path for root, globs in patterns.items() if root is not None for glob in globs for path in root.glob(glob)
    )


def read_sequence(source: ArcticSource, recording: Recording) -> RecordedSequence | None:
    """Read a recording, or return None if it is not there.

    Raises:
        UserError: a file of it is malformed or in other units.
    """
    files = sequence_files(source, recording)
    if not files:
        return None
    hands_path, object_path, *contact_paths = files
    sizes: dict[str, int] = {}
    hands = _read_hands(hands_path, sizes)
    try:
        state = check_array("states", read_npy(object_path), ("T", 7), np.float64, sizes)
        check_object_states("states", state)
    except ValueError as error:
        raise UserError(f"{object_path}: {error}") from None
    contacts = None
    if len(contact_paths) == len(HANDS):
        contacts = np.stack([_read_contacts(path, sizes) for path in contact_paths], axis=1)
    return RecordedSequence(hands["rot"], hands["pose"], hands["trans"], state, contacts)


def check_object_states(name: str, states: Array) -> None:
    """Refuse object states in other units: angles in degrees, translations in metres.

    Raises:
        ValueError: names the field, the first bad place and what was found there.
    """
    distance = np.linalg.norm(states[..., 4:], axis=-1)
    check_range(name, states[..., 0], -np.pi, 2 * np.pi, "rad")
    check_range(name, np.abs(states[..., 1:4]).max(axis=-1), 0.0, 4 * np.pi, "rad")
    # The table that all recordings happen on is a metre above the origin, the camera is further away.
    check_range(name, distance, 100.0, 10_000.0, "mm")


def check_hand_poses(prefix: str, poses: dict[str, Array]) -> None:
    """Refuse hand parameters in other units, given as arrays ``rot``, ``pose`` and ``trans``.

    Raises:
        ValueError: names the field, the first bad place and what was found there.
    """
    for name in ("rot", "pose"):
        check_range(f"{prefix}{name}", np.abs(poses[name]).max(axis=-1), 0.0, 4 * np.pi, "rad")
    check_range(f"{prefix}trans", np.linalg.norm(poses["trans"], axis=-1), 0.0, 10.0, "m")


def check_range(name: str, values: Array, lower: float, upper: float, unit: str) -> None:
    """Refuse numbers out of a range.

    Raises:
        ValueError: names the field, the first bad place and what was found there.
    """
    for index in np.argwhere((values < lower) | (values > upper))[:1]:
        where = ", ".join(str(i) for i in index)
        raise ValueError(f"{name}[{where}]: expected {lower:g} to {upper:g} {unit}, found {values[tuple(index)]:g}")


def _read_hands(path: Path, sizes: dict[str, int]) -> dict[str, Array]:
    data = read_npy(path, CLASSES)
    shapes: Iterable[tuple[str, int]] = (("rot", 3), ("pose", FINGER_DOF_COUNT), ("trans", 3))
    try:
        hands: dict[str, list[Array]] = {}
        for side in HANDS:
            parameters = _entry(data, side)
            poses = {
                name: check_array(f"{side}.{name}", _entry(parameters, name), ("T", size), np.float64, sizes)
                for name, size in shapes
            }
            check_hand_poses(f"{side}.", poses)
            for name, values in poses.items():
                hands.setdefault(name, []).append(values)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
    return {name: np.stack(values, axis=1) for name, values in hands.items()}


def _entry(data: Any, name: str) -> Any:
    if not isinstance(data, dict) or name not in data:
        raise ValueError(f"expected a dictionary with {name!r}, found none")
    return data[name]


def _read_contacts(path: Path, sizes: dict[str, int]) -> NDArray[np.bool_]:
    try:
        contacts = check_array("contacts", read_npy(path), ("T", CONTACT_ROWS, LINK_COUNT), np.float64, sizes)
        check_range("contacts", contacts, 0.0, 1.0, "")
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
    return contacts > 0
