"""Assets hold the physics that was read from them, and no other: Newton imports their files by itself.

Joints between other bodies, shapes that are moved or forces would be simulated, whatever hand or object was read; some
of it ends the importer's process.
"""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Usd

from artigrasp.errors import UserError

_NAMESPACES = ("physics:", "xformOp", "limit:", "drive:", "newton:", "mjc:")
_SHAPE_ATTRIBUTES = ("axis", "radius", "height", "size")
_SCHEMAS = ("Physics", "Newton", "Mjc")
_READ_ELSEWHERE = ("physics:diagonalInertia", "physics:principalAxes")
"""An inertia has more than one set of principal axes."""


def check_physics(path: Path, found: Usd.Stage, expected: Usd.Stage) -> None:
    """Refuse a file whose physics is not that of a stage, up to rounding.

    Args:
        path: The file.
        found: What is in it.
        expected: What would be written of the hand or object that was read from it.

    Raises:
        UserError: A prim, a relationship or an attribute is missing, one too many, or another.
    """
    by_path, wanted = _physics(found), _physics(expected)
    for prim in sorted(wanted.keys() | by_path.keys()):
        fields, others = wanted.get(prim), by_path.get(prim, {})
        if fields is None:
            if others["schemas"] or others["type"].startswith(_SCHEMAS):
                raise UserError(f"{path}: {prim}: expected no physics, found {others['schemas'] or others['type']}")
            continue
        for name in sorted(fields.keys() | others.keys()):
            value, other = fields.get(name), others.get(name)
            if not _is_same(value, other):
                raise UserError(f"{path}: {prim}: {name}: expected {_show(value)}, found {_show(other)}")


def _physics(stage: Usd.Stage) -> dict[str, dict[str, Any]]:
    """What an importer might simulate of each prim, by name."""
    found = {}
    for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
        schemas = sorted(name for name in prim.GetAppliedSchemas() if name.startswith(_SCHEMAS))
        fields: dict[str, Any] = {"type": str(prim.GetTypeName()), "schemas": " ".join(schemas)}
        for attribute in prim.GetAuthoredAttributes():
            name = attribute.GetName()
            is_physical = name.startswith(_NAMESPACES) or name in _SHAPE_ATTRIBUTES
            if is_physical and name not in _READ_ELSEWHERE and attribute.HasAuthoredValue():
                fields[name] = attribute.Get()
        for relationship in prim.GetAuthoredRelationships():
            if relationship.GetName().startswith(_NAMESPACES):
                fields[relationship.GetName()] = " ".join(map(str, relationship.GetTargets()))
        found[str(prim.GetPath())] = fields
    return found


def _is_same(value: Any, other: Any) -> bool:
    if value is None or other is None:
        return value is other
    if isinstance(value, Gf.Quatf | Gf.Quatd):
        # both signs are the same rotation
        return isinstance(other, type(value)) and abs(np.dot(_numbers(value), _numbers(other))) > 1 - 1e-6
    if isinstance(value, str | bool):
        return bool(value == other)
    try:
        return np.allclose(_numbers(value), _numbers(other), rtol=1e-4, atol=1e-6)
    except (TypeError, ValueError):
        return bool(value == other)


def _numbers(value: Any) -> Any:
    is_quaternion = isinstance(value, Gf.Quatf | Gf.Quatd)
    return np.array([*value.GetImaginary(), value.GetReal()] if is_quaternion else value, float)


def _show(value: Any) -> str:
    return "none" if value is None else repr(str(value))
