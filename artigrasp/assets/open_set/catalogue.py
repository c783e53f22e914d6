"""Every category of the open set, and the objects of it by name: `open-laptop`, or `open-laptop-3` of the seed 3."""

import re
from pathlib import Path
from typing import Protocol

import numpy as np

from artigrasp.assets.decomposition import cache_folder
from artigrasp.assets.object_model import ObjectModel
from artigrasp.assets.object_usd import write_object
from artigrasp.assets.open_set.box import Box
from artigrasp.assets.open_set.espresso_machine import EspressoMachine
from artigrasp.assets.open_set.hinged import Blueprint, make_part
from artigrasp.assets.open_set.ketchup_bottle import KetchupBottle
from artigrasp.assets.open_set.laptop import Laptop
from artigrasp.assets.open_set.microwave import Microwave
from artigrasp.assets.open_set.mixer import Mixer
from artigrasp.assets.open_set.notebook import Notebook
from artigrasp.assets.open_set.parameters import vary
from artigrasp.assets.open_set.scissors import Scissors
from artigrasp.assets.open_set.waffle_iron import WaffleIron
from artigrasp.errors import unknown


class Category(Protocol):
    """The sizes, masses and colours of one object of a category."""

    def blueprint(self) -> Blueprint:
        """The object, its front at -y, standing on z = 0 with its middle above the origin."""
        ...


CATEGORIES: dict[str, type[Category]] = {
    "box": Box,
    "espresso-machine": EspressoMachine,
    "ketchup-bottle": KetchupBottle,
    "laptop": Laptop,
    "microwave": Microwave,
    "mixer": Mixer,
    "notebook": Notebook,
    "waffle-iron": WaffleIron,
    "scissors": Scissors,
}
PAPER_CATEGORIES = tuple(name for name in CATEGORIES if name != "scissors")
"""Those of the paper's eight objects."""
_NAME = re.compile(r"open-([a-z-]+?)(?:-([1-9][0-9]{0,8}))?")
"""The prefix tells our objects from ARCTIC's, of which an import makes `box`, `laptop` and others."""


def object_name(category: str, seed: int = 0) -> str:
    """The name of a category's canonical object, or of the variant of a seed from 1 on."""
    return f"open-{category}-{seed}" if seed else f"open-{category}"


def parse_name(name: str) -> tuple[str, int] | None:
    """The category and seed that a name stands for; None if it is no name of the open set."""
    match = _NAME.fullmatch(name)
    if match is None or match[1] not in CATEGORIES:
        return None
    return match[1], int(match[2] or 0)


def make_open_object(category: str, seed: int, path: Path) -> ObjectModel:
    """The canonical object of a category, or the variant of a seed from 1 on, to live at ``path``.

    Raises:
        UserError: there is no such category.
    """
    if category not in CATEGORIES:
        raise unknown("category", category, tuple(CATEGORIES))
    plan = vary(CATEGORIES[category], seed).blueprint()
    return ObjectModel(
        name=object_name(category, seed),
        path=path,
        parts=(make_part(plan.base, plan.base_mass), make_part(plan.articulated, plan.articulated_mass)),
        hinge_origin=np.round(plan.hinge.origin, 5),
        hinge_axis=np.array(plan.hinge.axis),
        hinge_lower=0.0,
        hinge_upper=plan.hinge.upper,
        hinge_damping=plan.hinge.damping,
        hinge_friction=plan.hinge.friction,
    )


def written_variant(category: str, seed: int) -> Path:
    """The file of an object that is not among the assets, made anew in the cache folder."""
    path = cache_folder() / "objects" / f"{object_name(category, seed)}.usda"
    write_object(make_open_object(category, seed, path))
    return path
