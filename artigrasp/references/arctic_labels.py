"""The frames that ArtiGrasp's authors labelled, from their release or from the compact file of all of them.

The paper takes hand poses from frames in which hands hold or open the object. A label names such a ``grasp_frame``, and
an ``init_frame`` whose object pose starts the task. Image references are labelled in reconstructions of recordings; the
same frames of the recordings themselves are their counterparts.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array, check_array, load_plain_arrays
from artigrasp.assets.arctic import ArcticSource
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS, LINK_COUNT
from artigrasp.references.arctic_sequence import (
    CONTACT_ROWS,
    RecordedSequence,
    Recording,
    check_hand_poses,
    check_name,
    check_object_states,
    check_range,
    read_sequence,
    sequence_files,
)
from artigrasp.restricted_pickle import read_npy

IMAGES, COUNTERPARTS = "recon", "recon-mocap"
"""The splits of the image references and of their counterparts."""
LABEL_FOLDERS = {"train": "train_set", "test": "test_set", IMAGES: "test_recon"}
"""Where the release has the labels of each split."""


@dataclass(frozen=True)
class Label:
    """What somebody decided about a recording.

    Attributes:
        split: The split it belongs to.
        recording: The recording.
        task: The authors' kind of label, such as ``"right_arti"``.
        initial_frame: Frame whose object pose starts the task.
        frame: Frame that shows the hands.
    """

    split: str
    recording: Recording
    task: str
    initial_frame: int
    frame: int


@dataclass(frozen=True, eq=False)
class LabelledFrame:
    """A label and what its two frames show; hands in the order of ``HANDS``.

    Attributes:
        label: The label.
        initial_state: State of the object in the world at the initial frame, as in a sequence, shape (7,).
        state: State of the object at the frame that shows the hands, in the hands' world, shape (7,).
        rotation: As in a sequence, shape (2, 3).
        pose: As in a sequence, shape (2, 45).
        translation: As in a sequence, shape (2, 3).
        contacts: As in a sequence, shape (2, 3, 16).
    """

    label: Label
    initial_state: Array
    state: Array
    rotation: Array
    pose: Array
    translation: Array
    contacts: NDArray[np.bool_]


def label_files(source: ArcticSource, name: str) -> list[Path]:
    """The files that say which frames of an object are labelled; empty if there are none."""
    if source.labels is not None:
        return [source.labels]
    if source.release is None:
        return []
    folder = source.release / "mano_double" / "grasp_label" / "final_labels"
    return [path for split in LABEL_FOLDERS.values() if (path := folder / split / f"{name}.npy").is_file()]


def read_labelled_frames(source: ArcticSource, name: str) -> tuple[list[LabelledFrame], list[str]]:
    """The labelled frames of an object, each split in the order of its file.

    Returns:
        The frames, and lines that tell which labels gave none and why.

    Raises:
        UserError: a file is malformed.
    """
    sequences = _Sequences(source)
    if source.labels is not None:
        found = list(_from_compact_file(source.labels, name, sequences))
    else:
        found = [(label, sequences.frame(label)) for label in _from_release(source, name)]
    images = [label for label, _ in found if label.split == IMAGES]
    counterparts = [
        replace(label, split=COUNTERPARTS, recording=label.recording._replace(reconstructed=False)) for label in images
    ]
    found += [(label, sequences.frame(label)) for label in counterparts]
    missing = Counter((label.split, label.recording.subject) for label, frame in found if frame is None)
    skipped = [
        f"{name}: {count} {split} labels of {subject}: their sequences are not here"
        for (split, subject), count in sorted(missing.items())
    ]
    return [frame for _, frame in found if frame is not None], skipped


class _Sequences:
    """Cuts labelled frames out of sequences, each of which is read once."""

    def __init__(self, source: ArcticSource) -> None:
        self._source = source
        self._read = cache(lambda recording: read_sequence(source, recording))

    def frame(self, label: Label) -> LabelledFrame | None:
        """The frame of a label, or None if a recording or its contacts are not there."""
        shown: RecordedSequence | None = self._read(label.recording)
        initial_state = self.initial_state(label)
        if shown is None or shown.contacts is None or initial_state is None:
            return None
        index = self._index(label.recording, shown, label.frame)
        return LabelledFrame(
            label,
            initial_state,
            shown.object_state[index],
            shown.rotation[index],
            shown.pose[index],
            shown.translation[index],
            shown.contacts[index],
        )

    def initial_state(self, label: Label) -> Array | None:
        """The object's state in the world at a label's initial frame, or None if the recording is not there."""
        recording = label.recording._replace(reconstructed=False)
        recorded: RecordedSequence | None = self._read(recording)
        if recorded is None:
            return None
        state: Array = recorded.object_state[self._index(recording, recorded, label.initial_frame)]
        return state

    def _index(self, recording: Recording, sequence: RecordedSequence, frame: int) -> int:
        if not 0 <= frame < len(sequence.object_state):
            path = sequence_files(self._source, recording)[0]
            raise UserError(f"{path}: expected the labelled frame {frame}, found {len(sequence.object_state)} frames")
        return frame


_TEXTS = ("split", "subject", "sequence", "object", "kind")
_FIELDS: dict[str, tuple[tuple[int | str, ...], Any]] = {
    **dict.fromkeys(_TEXTS, (("N",), np.str_)),
    **dict.fromkeys(("init_frame", "grasp_frame"), (("N",), np.int64)),
    **dict.fromkeys(("object_init", "object_grasp"), (("N", 7), np.float64)),
    **{f"{side}_{name}": (("N", size), np.float64) for side in HANDS for name, size in (("rot", 3), ("trans", 3))},
    **{f"{side}_pose": (("N", 45), np.float64) for side in HANDS},
    **{f"{side}_contact": (("N", CONTACT_ROWS, LINK_COUNT), np.int64) for side in HANDS},
}


@cache
def _read_compact_file(path: Path, modified: int) -> dict[str, NDArray[Any]]:
    """The arrays of the compact file, N rows each; ``modified`` is when, for the cache."""
    arrays = load_plain_arrays(path)
    try:
        if missing := [name for name in _FIELDS if name not in arrays]:
            raise ValueError(f"{missing[0]}: expected an array, found none")
        sizes: dict[str, int] = {}
        rows = {name: check_array(name, arrays[name], *field, sizes) for name, field in _FIELDS.items()}
        for name in ("object_init", "object_grasp"):
            check_object_states(name, rows[name])
        for side in HANDS:
            check_hand_poses(f"{side}_", {name: rows[f"{side}_{name}"] for name in ("rot", "pose", "trans")})
            check_range(f"{side}_contact", rows[f"{side}_contact"], 0, 1, "")
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
    return rows


def labelled_objects(path: Path) -> list[str]:
    """The objects that the compact file has labels of, sorted."""
    return sorted(set(_read_compact_file(path, path.stat().st_mtime_ns)["object"].tolist()))


def read_labels(source: ArcticSource, name: str) -> list[Label]:
    """The labels of an object without what their frames show, each split in the order of its file.

    Raises:
        UserError: a file is malformed.
    """
    if source.labels is not None:
        return [label for label, _ in _rows_of_compact_file(source.labels, name)]
    return list(_from_release(source, name))


def _rows_of_compact_file(path: Path, name: str) -> Iterator[tuple[Label, dict[str, Any]]]:
    rows = _read_compact_file(path, path.stat().st_mtime_ns)
    for index in np.flatnonzero(rows["object"] == name):
        row = {field: values[index] for field, values in rows.items()}
        recording = Recording(str(row["subject"]), str(row["sequence"]), row["split"] == IMAGES)
        label = Label(str(row["split"]), recording, str(row["kind"]), int(row["init_frame"]), int(row["grasp_frame"]))
        _check_label(label, name, f"{path}: row {index}")
        yield label, row


def _from_compact_file(path: Path, name: str, sequences: _Sequences) -> Iterator[tuple[Label, LabelledFrame | None]]:
    for label, row in _rows_of_compact_file(path, name):
        both = {part: np.stack([row[f"{side}_{part}"] for side in HANDS]) for part in ("rot", "pose", "trans")}
        contacts = np.stack([row[f"{side}_contact"] for side in HANDS]) > 0
        # The camera's frame is not the world's.
        initial = sequences.initial_state(label) if label.recording.reconstructed else row["object_init"]
        if initial is None:
            yield label, None
        else:
            yield (
                label,
                LabelledFrame(label, initial, row["object_grasp"], both["rot"], both["pose"], both["trans"], contacts),
            )


def _from_release(source: ArcticSource, name: str) -> Iterator[Label]:
    splits = {folder: split for split, folder in LABEL_FOLDERS.items()}
    for path in label_files(source, name):
        split = splits[path.parent.name]
        rows = read_npy(path)
        if not isinstance(rows, list):
            raise UserError(f"{path}: expected a list of labels, found {type(rows).__name__}")
        for index, row in enumerate(rows):
            where = f"{path}: label {index}"
            try:
                recording = Recording(f"s{int(row['seq_num'])}", str(row["seq_name"]), split == IMAGES)
                label = Label(split, recording, str(row["kind"]), int(row["init_frame"]), int(row["grasp_frame"]))
            except (TypeError, ValueError, LookupError, OverflowError) as error:
                raise UserError(f"{where}: expected seq_num, seq_name, kind and two frames: {error!r}") from None
            _check_label(label, name, where)
            yield label


def _check_label(label: Label, name: str, where: str) -> None:
    try:
        check_name(label.recording, name)
        if label.split not in LABEL_FOLDERS:
            raise ValueError(f"expected one of the splits {', '.join(LABEL_FOLDERS)}, found {label.split!r}")
        if min(label.initial_frame, label.frame) < 0:
            raise ValueError(f"expected frames from 0, found {label.initial_frame} and {label.frame}")
    except ValueError as error:
        raise UserError(f"{where}: {error}") from None
