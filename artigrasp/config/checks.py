"""Range checks that the config classes make of their own fields."""

import reprlib
from typing import Any

from artigrasp.errors import UserError

_SHORT = reprlib.Repr()
_SHORT.maxdict = _SHORT.maxlist = _SHORT.maxtuple = 8
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxlong, _SHORT.maxother = 3, 200, 40, 200
"""Shows what was found, but not all of it: some kilobytes of YAML can name the same list a billion times."""


class FieldError(UserError):
    """A field of a config holds what it must not.

    Attributes:
        field: Name of the field, dotted when it lies in a nested config.
        problem: What is wrong with it.
    """

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"{field}: {problem}")
        self.field = field
        self.problem = problem

    @classmethod
    def mismatch(cls, field: str, expected: str, found: object) -> "FieldError":
        """The error for a value that is not what was expected."""
        return cls(field, f"expected {expected}, found {_SHORT.repr(found)}")


def require_positive(config: Any, *fields: str) -> None:
    """Raise a FieldError unless every one of these fields is greater than zero."""
    for field in fields:
        value = getattr(config, field)
        if not value > 0:
            raise FieldError.mismatch(field, "a positive number", value)


def require_not_negative(config: Any, *fields: str) -> None:
    """Raise a FieldError unless every one of these fields is zero or greater."""
    for field in fields:
        value = getattr(config, field)
        if not value >= 0:
            raise FieldError.mismatch(field, "zero or a positive number", value)


def require_fraction(config: Any, *fields: str) -> None:
    """Raise a FieldError unless every one of these fields lies between 0 and 1, both included."""
    for field in fields:
        value = getattr(config, field)
        if not 0 <= value <= 1:
            raise FieldError.mismatch(field, "a number between 0 and 1", value)


def require_name(config: Any, field: str) -> None:
    """Raise a FieldError unless the field holds lower case words joined by hyphens."""
    value = getattr(config, field)
    if not value or not value.replace("-", "").isalnum() or value != value.lower():
        raise FieldError.mismatch(field, "lower case words joined by hyphens", value)


def require_ordered_choice(config: Any, field: str, choices: tuple[str, ...]) -> None:
    """Raise a FieldError unless the field holds one or more of the choices, each once and in their order."""
    value = getattr(config, field)
    if not value or value != tuple(choice for choice in choices if choice in value):
        raise FieldError.mismatch(field, f"some of {', '.join(choices)}, each once and in this order", value)
