"""What a hand is, in numbers: a tree of 16 links on 51 degrees of freedom.

In the zero pose all link frames are axis-aligned with the hand's base, from which the wrist is moved by three slides
and three turns. A right hand's fingers point to -x, its thumb towards +z, its palm to -y, and positive rotation about z
flexes its fingers; a left hand is the mirror image across x = 0.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.hand_skin import HandSkin, mirror_skin
from artigrasp.kernels.layout import FINGER_DOF_COUNT, LINK_COUNT, LINK_PARENTS

MIRROR_POSITION = np.array([-1.0, 1.0, 1.0])
"""Factors that mirror a vector across x = 0."""
MIRROR_ROTATION = np.array([1.0, -1.0, -1.0])
"""Factors that mirror a rotation vector, an angular limit or a quaternion's vector part across x = 0."""
MIRROR_FINGERS = np.tile(MIRROR_ROTATION, FINGER_DOF_COUNT // 3)
"""Factors that mirror finger angles, shape (45,)."""


@dataclass(frozen=True, eq=False)
class Capsule:
    """A capsule along its local z axis.

    Attributes:
        position: Centre in the link frame [m], shape (3,).
        orientation: Rotation from the local to the link frame, xyzw, shape (4,).
        radius: Radius [m].
        length: Length of the cylinder between the two caps [m].
    """

    position: Array
    orientation: Array
    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class Box:
    """A box.

    Attributes:
        position: Centre in the link frame [m], shape (3,).
        orientation: Rotation from the local to the link frame, xyzw, shape (4,).
        extents: Edge lengths [m], shape (3,).
    """

    position: Array
    orientation: Array
    extents: Array


Collider = Capsule | Box


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand in the orders of :mod:`artigrasp.kernels.layout`.

    Attributes:
        name: Name of the hand, the same on both sides, such as ``"open"``.
        side: ``"left"`` or ``"right"``.
        path: The USD file of this hand.
        link_offset: Origin of each link in its parent's frame [m], shape (16, 3); zero for the wrist.
        tip_offset: Fingertips in the frames of ``TIP_LINKS`` [m], shape (5, 3).
        lower: Lower joint limits [m, rad], shape (51,).
        upper: Upper joint limits [m, rad], shape (51,).
        damping: Passive joint damping [N·s/m, N·m·s/rad], shape (51,).
        armature: Inertia added to each joint [kg, kg·m²], shape (51,).
        effort: Largest joint force or torque [N, N·m], shape (51,).
        link_mass: Mass of each link [kg], shape (16,).
        link_com: Centre of mass of each link in its own frame [m], shape (16, 3).
        link_inertia: Inertia of each link about its centre of mass, in its own axes [kg·m²], shape (16, 3, 3).
        colliders: The collision shapes of each link.
        skin: What is seen of it; None if its file has none, as those of earlier versions.
    """

    name: str
    side: str
    path: Path
    link_offset: Array
    tip_offset: Array
    lower: Array
    upper: Array
    damping: Array
    armature: Array
    effort: Array
    link_mass: Array
    link_com: Array
    link_inertia: Array
    colliders: tuple[tuple[Collider, ...], ...]
    skin: HandSkin | None = None

    @property
    def link_origin(self) -> Array:
        """Origins of the links in the zero pose, in the frame of the wrist link [m], shape (16, 3)."""
        origins = np.zeros((LINK_COUNT, 3))
        for link in range(1, LINK_COUNT):
            origins[link] = origins[LINK_PARENTS[link]] + self.link_offset[link]
        return origins


def mirror(hand: HandModel, path: Path) -> HandModel:
    """The same hand for the other side: its exact mirror image across x = 0.

    Args:
        hand: A hand of either side.
        path: The USD file of the mirrored hand.
    """
    factor = np.concatenate([MIRROR_POSITION, np.tile(MIRROR_ROTATION, len(hand.link_offset))])
    lower, upper = hand.lower * factor, hand.upper * factor
    return replace(
        hand,
        side="left" if hand.side == "right" else "right",
        path=path,
        link_offset=hand.link_offset * MIRROR_POSITION,
        tip_offset=hand.tip_offset * MIRROR_POSITION,
        lower=np.minimum(lower, upper),
        upper=np.maximum(lower, upper),
        link_com=hand.link_com * MIRROR_POSITION,
        link_inertia=hand.link_inertia * np.outer(MIRROR_POSITION, MIRROR_POSITION),
        colliders=tuple(tuple(_mirror_collider(collider) for collider in link) for link in hand.colliders),
        skin=None if hand.skin is None else mirror_skin(hand.skin),
    )


def _mirror_collider(collider: Collider) -> Collider:
    orientation = collider.orientation * np.append(MIRROR_ROTATION, 1.0)
    return replace(collider, position=collider.position * MIRROR_POSITION, orientation=orientation)
