"""The file of a motion; ``docs/motion-format.md`` describes it."""

import json
import os
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import check_array, load_arrays, save_arrays
from artigrasp.config import StageConfig
from artigrasp.config.checks import FieldError
from artigrasp.errors import UserError
from artigrasp.kernels.layout import LINK_COUNT
from artigrasp.motion.mano import mano_parameters
from artigrasp.motion.motion import Motion, MotionBystanders, MotionReference

__all__ = ["Motion", "MotionBystanders", "MotionReference", "load_motion", "save_motion"]

MOTION_FORMAT = "artigrasp.motion"
MOTION_VERSION = 2

_JSON_FIELDS = ("metrics", "provenance")
_GROUPS: Mapping[str, tuple[str, Any]] = {
    "bystanders": ("bystander", MotionBystanders),
    "stage": ("stage", StageConfig),
    "reference": ("reference", MotionReference),
}
"""Fields of a motion that are groups of arrays, or absent: how the arrays' names begin, and what they make."""
_OPTIONAL_FIELDS = ("target_object_pose",)
_ARRAY_FIELDS = tuple(
    field.name for field in fields(Motion) if field.name not in (*_JSON_FIELDS, *_OPTIONAL_FIELDS, *_GROUPS)
)
_MANO_FIELDS = {"mano_pose": ("T", "H", LINK_COUNT, 3), "mano_translation": ("T", "H", 3)}
"""Written for other readers; they follow from the joint coordinates."""


def save_motion(path: str | os.PathLike[str], motion: Motion) -> None:
    """Write a motion to an ``.npz`` file.

    Raises:
        UserError: The place cannot be written to.
    """
    arrays = {name: np.asarray(getattr(motion, name)) for name in _ARRAY_FIELDS}
    arrays |= {name: np.asarray(json.dumps(dict(getattr(motion, name)))) for name in _JSON_FIELDS}
    arrays |= {name: getattr(motion, name) for name in _OPTIONAL_FIELDS if getattr(motion, name) is not None}
    for name, (prefix, group) in _GROUPS.items():
        if (held := getattr(motion, name)) is not None:
            arrays |= {f"{prefix}_{each.name}": np.asarray(getattr(held, each.name)) for each in fields(group)}
    arrays |= dict(zip(_MANO_FIELDS, mano_parameters(motion), strict=True))
    save_arrays(path, MOTION_FORMAT, MOTION_VERSION, arrays)


def load_motion(path: str | os.PathLike[str]) -> Motion:
    """Read a motion that :func:`save_motion` wrote.

    Raises:
        UserError: The file is missing, damaged, of another kind, newer than this program, or not a valid motion. The
            message names the file and the field.
    """
    arrays = load_arrays(path, MOTION_FORMAT, MOTION_VERSION)
    groups = {
        name: {each.name: f"{prefix}_{each.name}" for each in fields(group)}
        for name, (prefix, group) in _GROUPS.items()
    }
    present = {name: names for name, names in groups.items() if not arrays.keys().isdisjoint(names.values())}
    expected = [*_ARRAY_FIELDS, *_JSON_FIELDS, *(each for names in present.values() for each in names.values())]
    for name in expected:
        if name not in arrays:
            raise UserError(f"{path}: {name}: this field is missing")
    for name in arrays:
        if name not in (*expected, *_OPTIONAL_FIELDS, *_MANO_FIELDS):
            raise UserError(f"{path}: {name}: unknown field")
    try:
        values: dict[str, Any] = dict(arrays)
        sizes = {"T": values["time"].size, "H": values["hands"].size}
        for name, shape in _MANO_FIELDS.items():
            if name in values:
                check_array(name, values.pop(name), shape, np.float32, sizes)
        values["hands"] = tuple(check_array("hands", arrays["hands"], ("H",), np.str_).tolist())
        values |= {name: _text(name, arrays[name]) for name in ("hand", "object")}
        values |= {name: _table(name, arrays[name]) for name in _JSON_FIELDS}
        for name, names in present.items():
            held = {each: values.pop(stored) for each, stored in names.items()}
            values[name] = _stage(**held) if name == "stage" else _GROUPS[name][1](**held)
        return Motion(**values)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _stage(height: NDArray[Any], size: NDArray[Any], position: NDArray[Any]) -> StageConfig:
    width, depth = check_array("stage_size", size, (2,), np.float64).tolist()
    x, y = check_array("stage_position", position, (2,), np.float64).tolist()
    try:
        return StageConfig(float(check_array("stage_height", height, (), np.float64)), (width, depth), (x, y))
    except FieldError as error:
        raise ValueError(f"stage_{error}") from None


def _text(name: str, array: NDArray[Any]) -> str:
    return str(check_array(name, array, (), np.str_))


def _table(name: str, array: NDArray[Any]) -> dict[str, Any]:
    try:
        table = json.loads(_text(name, array))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{name}: expected a JSON object, found text that fails with: {error}") from error
    if not isinstance(table, dict):
        raise ValueError(f"{name}: expected a JSON object, found {type(table).__name__}")
    return table
