"""References: static hand poses on an object, one per hand and task, from which motions are made.

All references of an object live in one file, ``references/<object>.npz``.
"""

import importlib.metadata
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artigrasp.arrays import check_array, check_poses, load_arrays, save_arrays
from artigrasp.assets.library import find_asset, list_assets
from artigrasp.assets.open_set.catalogue import parse_name
from artigrasp.errors import UserError, unknown
from artigrasp.kernels.layout import FINGER_DOF_COUNT, HANDS, LINK_COUNT, PARTS
from artigrasp.references.splits import SCHEME_SPLITS, in_split

FORMAT, VERSION = "artigrasp.references", 3
KINDS = ("articulate", "grasp")

_SHAPES: dict[str, tuple[tuple[int | str, ...], Any]] = {
    "kind": (("R",), np.str_),
    "split": (("R",), np.str_),
    "active": (("R", len(HANDS)), np.bool_),
    "part": (("R", len(HANDS)), np.int32),
    "finger_angles": (("R", len(HANDS), FINGER_DOF_COUNT), np.float32),
    "contacts": (("R", len(HANDS), LINK_COUNT), np.bool_),
    "object_angle": (("R",), np.float32),
    "source": (("R",), np.str_),
    "subject": (("R",), np.str_),
    "sequence": (("R",), np.str_),
    "frame": (("R",), np.int32),
}
_LARGEST_ANGLE, _FARTHEST = 2 * np.pi, 10.0
"""What is beyond is in degrees or millimetres [rad, m]."""
_RECORDING = ("subject", "sequence", "frame")
"""What files of version 1 lack. One value may stand for all references."""
_TEXTS = ("object", "hand", "provenance")
"""What is one text for all references; files before version 3 lack the last."""
_POSES: dict[str, tuple[int | str, ...]] = {"wrist_pose_in_part": ("R", len(HANDS)), "object_pose": ("R",)}


@dataclass(frozen=True, eq=False)
class ReferenceSet:
    """R references of one object. Hands are in the order of ``HANDS``, links and joints in that of the layout.

    Attributes:
        object: Name of the object.
        hand: Name of the hand that the joint angles belong to.
        kind: ``"articulate"`` or ``"grasp"``, shape (R,).
        split: Which split it was given, such as ``"train"``, shape (R,).
        active: Which hands take part, shape (R, 2). A hand that does not has a pose but no target contacts.
        part: Index in ``PARTS`` of the part that each hand's pose is relative to, shape (R, 2): the articulated one for
            the hand that articulates, else the base.
        wrist_pose_in_part: Wrist frame in that part's frame: position [m], quaternion xyzw, shape (R, 2, 7).
        finger_angles: Intrinsic XYZ angles per finger joint [rad], shape (R, 2, 45).
        contacts: Links that should touch the object, shape (R, 2, 16): the articulated part for the hand that
            articulates, either part for a grasp. May be none at all.
        object_pose: Initial pose of the base in the world, resting on z = 0: position [m], quaternion xyzw, (R, 7).
        object_angle: Initial hinge angle [rad], shape (R,).
        source: Where it came from, in words, shape (R,).
        subject: Whose recording it comes from, such as ``"s5"``; empty if from none or from an unknown one, shape (R,).
        sequence: Name of that recording, such as ``"box_use_02"``, or empty, shape (R,).
        frame: Frame of that recording that shows the hands, or -1, shape (R,).
        provenance: JSON of the program that made them and its settings, as of :func:`describe_provenance`, or empty.
    """

    object: str
    hand: str
    kind: NDArray[np.str_]
    split: NDArray[np.str_]
    active: NDArray[np.bool_]
    part: NDArray[np.int32]
    wrist_pose_in_part: NDArray[np.float32]
    finger_angles: NDArray[np.float32]
    contacts: NDArray[np.bool_]
    object_pose: NDArray[np.float32]
    object_angle: NDArray[np.float32]
    source: NDArray[np.str_]
    subject: NDArray[np.str_] = field(default_factory=lambda: np.array(""))
    sequence: NDArray[np.str_] = field(default_factory=lambda: np.array(""))
    frame: NDArray[np.int32] = field(default_factory=lambda: np.array(-1))
    provenance: str = ""

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for name in _RECORDING:
            if np.ndim(value := getattr(self, name)) == 0:
                object.__setattr__(self, name, np.full(np.shape(self.kind)[:1], value))
        for name, (shape, dtype) in _SHAPES.items():
            object.__setattr__(self, name, check_array(name, getattr(self, name), shape, dtype, sizes))
        for name, shape in _POSES.items():
            object.__setattr__(self, name, check_poses(name, getattr(self, name), shape, sizes))
        _check_values("kind", self.kind, KINDS)
        _check_values("part", self.part, range(len(PARTS)))
        for name in ("finger_angles", "object_angle"):
            _check_magnitude(name, getattr(self, name), _LARGEST_ANGLE, "rad")
        for name in _POSES:
            _check_magnitude(name, getattr(self, name)[..., :3], _FARTHEST, "m")
        idle = np.flatnonzero(~self.active.any(axis=1))
        if len(idle):
            raise ValueError(f"active[{idle[0]}]: expected at least one active hand, found none")

    def __len__(self) -> int:
        return len(self.kind)

    def splits(self) -> tuple[str, ...]:
        """The splits that :meth:`select` finds something in: the given ones, then those of the schemes."""
        given = sorted(set(self.split.tolist()))
        return (*given, *(split for split in SCHEME_SPLITS if self._in_split(split).any()))

    def has(self, split: str, kind: str | tuple[str, ...]) -> bool:
        """Whether there is a reference of a split, as :meth:`select` takes it, and of one of these kinds."""
        return bool(np.isin(self.kind[self._in_split(split)], kind).any())

    def _in_split(self, split: str) -> NDArray[np.bool_]:
        return in_split(split, self.split, self.subject, self.sequence)

    def select(
        self,
        *,
        split: str | None = None,
        kind: str | tuple[str, ...] | None = None,
        hands: Sequence[str] = HANDS,
        indices: ArrayLike | None = None,
    ) -> Self:
        """The references of a split, of one or more kinds and hands, in their order.

        Args:
            split: Only these, either given ones, such as ``"train"``, or those of a scheme of
                :mod:`artigrasp.references.splits`, such as ``"by-subject/test"``; every split by default.
            kind: Only this one or these; every kind by default.
            hands: Only those in which one of these takes part.
            indices: Out of what then remains, these; all by default.

        Raises:
            UserError: nothing remains, or an index is out of range.
        """
        rows = np.arange(len(self))
        if split is not None:
            rows = rows[self._in_split(split)]
        if kind is not None:
            rows = rows[np.isin(self.kind[rows], kind)]
        rows = rows[self.active[rows][:, [HANDS.index(side) for side in hands]].any(axis=1)]
        wanted = ((each,) if isinstance(each, str) else each for each in (split, kind) if each is not None)
        chosen = f"{self.object}: references" + "".join(f" of {' or '.join(map(repr, each))}" for each in wanted)
        chosen += f" of the {hands[0]} hand" if len(hands) == 1 else ""
        if not len(rows):
            there = ", ".join(f"{s} {k}" for s in self.splits() for k in sorted(set(self.kind[self._in_split(s)])))
            raise UserError(f"{chosen}: found none; there are {there or 'no references at all'}")
        if indices is not None:
            picked = np.atleast_1d(np.asarray(indices, np.int64))
            outside = picked[(picked < 0) | (picked >= len(rows))]
            if len(outside):
                raise UserError(f"{chosen}: expected indices from 0 to {len(rows) - 1}, found {outside[0]}")
            rows = rows[picked]
        return replace(self, **{name: getattr(self, name)[rows] for name in (*_SHAPES, *_POSES)})


def join_references(sets: Sequence[ReferenceSet]) -> ReferenceSet:
    """All references of some sets of one object and hand, set after set."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(each, name) for each in sets]) for name in (*_SHAPES, *_POSES)
    }
    return replace(sets[0], **columns)


def load_references(object_name: str) -> ReferenceSet:
    """Load the references of an object from the asset roots.

    Raises:
        UserError: the object has none, or the file is malformed or of another object; names the file, the field and
            the index.
    """
    if object_name not in (names := list_assets("references")):
        if object_name not in (objects := list_assets("objects")) and parse_name(object_name) is None:
            raise unknown("object", object_name, objects)
        raise UserError(f"object {object_name!r}: found no references; there are some of {', '.join(names) or 'none'}")
    references = read_references(path := find_asset("references", object_name))
    if references.object != object_name:
        raise UserError(f"{path}: object: expected {object_name!r}, found {references.object!r}")
    return references


def read_references(path: Path) -> ReferenceSet:
    """Read a file of references.

    Raises:
        UserError: the file is missing or malformed; names the file, the field and the index.
    """
    arrays = load_arrays(path, FORMAT, VERSION)
    names = [each.name for each in fields(ReferenceSet)]
    if not any(name in arrays for name in _RECORDING):
        names = [name for name in names if name not in _RECORDING]
    if "provenance" not in arrays:
        names.remove("provenance")
    if missing := [name for name in names if name not in arrays]:
        raise UserError(f"{path}: {missing[0]}: expected an array, found none")
    try:
        values: dict[str, Any] = {name: arrays[name] for name in names}
        for name in (name for name in _TEXTS if name in values):
            values[name] = str(check_array(name, arrays[name], (), np.str_))
        return ReferenceSet(**values)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None


def save_references(path: Path, references: ReferenceSet) -> None:
    """Write a file of references, whole or not at all."""
    arrays = {each.name: np.asarray(getattr(references, each.name)) for each in fields(references)}
    save_arrays(path, FORMAT, VERSION, arrays)


def describe_provenance(made_by: str, **settings: Any) -> str:
    """The provenance of references: JSON of the program that made them, its version and its settings.

    Args:
        made_by: The program, such as the verb ``"extract-references"``.
        settings: Whatever its result depends on besides its input, of JSON's types.
    """
    version = importlib.metadata.version("artigrasp")
    return json.dumps({"made_by": made_by, "artigrasp": version, **settings}, sort_keys=True)


def _check_values(name: str, values: NDArray[Any], expected: Iterable[str | int]) -> None:
    for index in np.argwhere(~np.isin(values, np.array(list(expected))))[:1]:
        where = ", ".join(str(i) for i in index)
        known = ", ".join(str(value) for value in expected)
        raise ValueError(f"{name}[{where}]: expected one of {known}, found {values[tuple(index)]}")


def _check_magnitude(name: str, values: NDArray[np.float32], largest: float, unit: str) -> None:
    for index in np.argwhere(np.abs(values) > largest)[:1]:
        where = ", ".join(str(i) for i in index)
        raise ValueError(
            f"{name}[{where}]: expected at most {largest:.3g} {unit} either way, found {values[tuple(index)]:.3g}"
        )
