"""What varies in an open object: sizes and masses with their ranges, and choices, as the fields of a dataclass."""

from dataclasses import MISSING, dataclass, field, fields
from typing import Any, Literal, TypeVar

import numpy as np

T = TypeVar("T")
Unit = Literal["m", "kg", "rad", "N·m", "N·m·s/rad"]
Split = Literal["train", "unseen"]

FIRST_UNSEEN_SEED = 1000
"""Variants of this seed and later ones are never trained on."""


@dataclass(frozen=True)
class Range:
    """What a number of an object may be.

    Attributes:
        low: The least.
        high: The most.
        unit: Of all of them.
        source: Where the numbers come from.
    """

    low: float
    high: float
    unit: Unit
    source: str


def ranged(canonical: float, low: float, high: float, unit: Unit, source: str) -> Any:
    """A field with a number: that of the canonical object, and the range of its variants."""
    return field(default=canonical, metadata={"values": Range(low, high, unit, source)})


def chosen(*options: Any) -> Any:
    """A field with one of some options, of which the canonical object has the first."""
    return field(default=options[0], metadata={"values": options})


def vary(kind: type[T], seed: int) -> T:
    """The variant of a dataclass of such fields that belongs to a seed from 1 on; that of 0 is the canonical one."""
    if seed == 0:
        return kind()
    # One stream for each field, so that a new field leaves the others as they were.
    values: dict[str, Any] = {}
    for each in fields(kind):  # type: ignore[arg-type]
        random = np.random.default_rng([seed, *each.name.encode()])
        values[each.name] = _draw(each.metadata["values"], random)
    return kind(**values)


def ranges(kind: type) -> dict[str, Range]:
    """The ranges of a dataclass of such fields, by the field's name."""
    found = {each.name: each.metadata["values"] for each in fields(kind) if each.default is not MISSING}
    return {name: values for name, values in found.items() if isinstance(values, Range)}


def split_of(seed: int) -> Split:
    """Whether a variant is one to train on or one to be measured on."""
    return "train" if seed < FIRST_UNSEEN_SEED else "unseen"


def _draw(values: "Range | tuple[Any, ...]", random: np.random.Generator) -> Any:
    if isinstance(values, Range):
        return round(float(random.uniform(values.low, values.high)), 5)
    return values[random.integers(len(values))]
