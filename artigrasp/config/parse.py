"""Configs to plain data and back; reading is strict and names what it refuses by its dotted key."""

import dataclasses
import inspect
import math
import types
from collections.abc import Mapping
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from artigrasp.config.checks import FieldError
from artigrasp.errors import UserError, nearest

Config = TypeVar("Config")

_SCALARS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


def to_dict(config: Any) -> dict[str, Any]:
    """Plain data of a config, fit for JSON: nested configs become dicts and tuples become lists."""
    return {field.name: _plain(getattr(config, field.name)) for field in dataclasses.fields(config)}


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_dict(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value


def from_dict(cls: type[Config], data: object, source: str = "config") -> Config:
    """Build a config from plain data, refusing what it does not know.

    A key that is absent takes its default.

    Args:
        cls: A config class.
        data: Plain data as :func:`to_dict` gives it.
        source: Where the data came from, such as a file's path, for the message.

    Raises:
        UserError: There is an unknown key, a value of the wrong type or out of range, or no value for a key that
            has no default. The message names the dotted key, what was expected and what was found.
    """
    try:
        return _build(cls, data, key="")
    except FieldError as error:
        raise UserError(f"{source}: {error}") from error


def _build(cls: type[Config], data: object, key: str) -> Config:
    if not isinstance(data, Mapping):
        raise FieldError.mismatch(key or "(whole)", "a table of keys and values", data)
    fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    hints = get_type_hints(cls)
    values = {}
    for name, value in data.items():
        if name not in fields:
            suggestion = nearest(str(name), fields)
            hint = f"did you mean {suggestion!r}?" if suggestion else f"expected one of {', '.join(fields)}"
            raise FieldError(_join(key, str(name)), f"unknown key: {hint}")
        values[name] = _convert(hints[name], value, _join(key, name))
    for name, field in fields.items():
        if name not in values and field.default is field.default_factory is dataclasses.MISSING:
            raise FieldError(_join(key, name), "expected a value, found none")
    try:
        return cls(**values)
    except FieldError as error:
        raise FieldError(_join(key, error.field), error.problem) from error


def _kind(kinds: list[Any], value: object, key: str) -> Any:
    """Which of several config classes is meant: the one whose own first field, no inherited one, is there."""
    names = [next(iter(inspect.get_annotations(kind))) for kind in kinds]
    found = [str(name) for name in value] if isinstance(value, Mapping) else []
    meant = [kind for kind, name in zip(kinds, names, strict=True) if name in found]
    if len(meant) != 1:
        suggestions = {suggestion: name for name in found if (suggestion := nearest(name, names)) is not None}
        if not meant and suggestions:
            suggestion, name = next(iter(suggestions.items()))
            raise FieldError(_join(key, name), f"unknown key: did you mean {suggestion!r}?")
        raise FieldError.mismatch(key, f"one of the keys {', '.join(names)}", ", ".join(found) or value)
    return meant[0]


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _convert(hint: Any, value: object, key: str) -> Any:
    """The value as the annotated type has it.

    Raises:
        FieldError: The value is of another type.
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if dataclasses.is_dataclass(hint):
        return _build(hint, value, key)  # type: ignore[arg-type]
    if origin is Literal:
        if value not in arguments:
            raise FieldError.mismatch(key, f"one of {', '.join(map(repr, arguments))}", value)
        return value
    if origin in (Union, types.UnionType):
        choices = [argument for argument in arguments if argument is not types.NoneType]
        if value is None and types.NoneType in arguments:
            return None
        return _convert(choices[0] if len(choices) == 1 else _kind(choices, value, key), value, key)
    if origin is Mapping:
        if not isinstance(value, Mapping):
            raise FieldError.mismatch(key, "a table of keys and values", value)
        return {
            _convert(str, name, key): _convert(arguments[1], item, _join(key, str(name)))
            for name, item in value.items()
        }
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise FieldError.mismatch(key, "a list", value)
        kinds = arguments[:1] * len(value) if arguments[-1] is Ellipsis else arguments
        if len(value) != len(kinds):
            raise FieldError.mismatch(key, f"a list of {len(kinds)} values", value)
        pairs = zip(kinds, value, strict=True)
        return tuple(_convert(kind, item, f"{key}[{index}]") for index, (kind, item) in enumerate(pairs))
    accepted = (int, float) if hint is float else hint
    # bool is a subclass of int, but True is no number here.
    if not isinstance(value, accepted) or (isinstance(value, bool) and hint is not bool):
        raise FieldError.mismatch(key, _SCALARS[hint], value)
    return _finite(value, key) if hint is float else value


def _finite(value: float, key: str) -> float:
    try:
        number = float(value)
    except OverflowError:  # JSON's whole numbers have no bound
        number = math.inf
    if not math.isfinite(number):
        raise FieldError.mismatch(key, "a finite number", value)
    return number
