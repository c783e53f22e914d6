"""What a motion shows: rigid bodies with a surface, a colour and a path through time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.export.surface import Surface, link_surface, mesh_surface
from artigrasp.kernels.layout import LINK_COUNT, LINKS, PARTS
from artigrasp.motion.file import Motion
from artigrasp.motion.kinematics import link_poses, part_poses

Colour = tuple[float, float, float]

SKIN: Colour = (0.74, 0.40, 0.27)
"""Linear RGB of the hands."""


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body of a motion with T samples.

    Attributes:
        name: Name of the hand link or object part.
        surface: In the frame of the body.
        colour: Linear RGB, each 0 to 1.
        poses: Of the body in the world: position [m], quaternion xyzw, shape ``[T, 7]``.
    """

    name: str
    surface: Surface
    colour: Colour
    poses: NDArray[np.float32]


def load_models(motion: Motion) -> tuple[tuple[HandModel, ...], ObjectModel]:
    """The models of a motion's hands and object.

    Raises:
        UserError: one of them is not among the assets.
    """
    return tuple(load_hand(motion.hand, side) for side in motion.hands), load_object(motion.object)


def hand_bodies(motion: Motion, hands: Sequence[HandModel]) -> list[tuple[Body, ...]]:
    """The 16 links of each hand of a motion."""
    poses = link_poses(motion, hands)
    return [
        tuple(Body(LINKS[link], link_surface(hand, link), SKIN, poses[:, index, link]) for link in range(LINK_COUNT))
        for index, hand in enumerate(hands)
    ]


def object_bodies(motion: Motion, object: ObjectModel) -> tuple[Body, ...]:
    """The two parts of the object of a motion."""
    poses = part_poses(motion, object)
    return tuple(
        Body(name, mesh_surface(part.vertices, part.faces), part.colour, poses[:, index])
        for index, (name, part) in enumerate(zip(PARTS, object.parts, strict=True))
    )
