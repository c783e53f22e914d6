"""`artigrasp make-object`: objects of the open set, without end."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Make an object of the open set, as a USD file: the canonical one of a category, or a variant by its seed.

    All of them are known by name as well, as open-laptop or open-laptop-7, without being made first. Seeds below 1000
    are meant for training, the others for measuring on what was never seen. Without a category, the categories are
    listed.

    With --json: {"path": file, "name": name, "split": "train" or "unseen", "values": {name: value}, "ranges": {name:
    {"low", "high", "unit", "source"}}}; without a category, {category: ranges}.
    """

    category: Annotated[str, tyro.conf.Positional] = ""
    """Box, espresso-machine, ketchup-bottle, laptop, microwave, mixer, notebook, waffle-iron or scissors."""
    seed: int = 0
    """Of the variant; 0 is the canonical object."""
    out: Path | None = None
    """File to write; by default named after the object, in this folder."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Write the object and tell its sizes."""
    from dataclasses import asdict, fields

    from artigrasp.assets.object import write_object
    from artigrasp.assets.open_set.catalogue import CATEGORIES, make_open_object, object_name
    from artigrasp.assets.open_set.parameters import ranges, split_of, vary
    from artigrasp.errors import UserError, unknown

    if not options.category:
        if options.json:
            show_json(
                {name: {key: asdict(each) for key, each in ranges(kind).items()} for name, kind in CATEGORIES.items()}
            )
        else:
            show_columns([(name, _summary(kind)) for name, kind in CATEGORIES.items()])
        return 0
    category = options.category.lower().removeprefix("open-")
    if category not in CATEGORIES:
        raise unknown("category", options.category, tuple(CATEGORIES))
    if not 0 <= options.seed < 10**9:
        raise UserError(f"seed: expected 0 to 999999999, found {options.seed}")
    name = object_name(category, options.seed)
    path = options.out or Path(f"{name}.usda")
    if path.suffix != ".usda":
        raise UserError(f"{path}: expected a name that ends in .usda")
    check_target(path)
    write_object(make_open_object(category, options.seed, path))
    plan: Any = vary(CATEGORIES[category], options.seed)
    values = {field.name: getattr(plan, field.name) for field in fields(plan)}
    units = ranges(CATEGORIES[category])
    if options.json:
        described = {key: asdict(each) for key, each in units.items()}
        show_json(
            {"path": str(path), "name": name, "split": split_of(options.seed), "values": values, "ranges": described}
        )
        return 0
    show_columns(
        [
            (f"  {key}", f"{values[key]:.4g} {each.unit}", f"({each.low:g} to {each.high:g})")
            for key, each in units.items()
        ]
    )
    show(f"wrote {path}: {name}")
    return 0


def _summary(kind: type) -> str:
    """What the module of a category says that it is."""
    return (sys.modules[kind.__module__].__doc__ or "").splitlines()[0]
