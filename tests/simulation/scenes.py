"""The scenes that the simulation's tests share."""

import functools

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import PhysicsConfig
from artigrasp.simulation.scene import Scene


@functools.cache
def open_scene(fixed_base: bool, sides: tuple[str, ...] = ("right",)) -> Scene:
    """Open hands and the lidded box."""
    return Scene(
        tuple(load_hand("open", side) for side in sides), (load_object("lidded-box"),), fixed_base, PhysicsConfig()
    )
