"""The form of a hand's flesh, as a distance field around its bones.

Everything is a *limb*: a chain of points with a radius at each. Fingers are limbs along the phalanges, as thick as
their collision shapes; the palm is limbs along the metacarpals with pads on its inner side and webs between the
fingers, as thick as the collision shapes of the wrist link. Limbs melt into each other.

All of it is a right hand in its zero pose: fingers towards -x, thumb towards +z, palm towards -y.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import Box, Capsule, HandModel
from artigrasp.kernels.layout import FINGERS, LONG_FINGERS, TIP_FINGERS

PALM_MELT, FINGER_MELT, CREASE_MELT = 0.016, 0.009, 0.0012
"""Over which distance limbs melt: of the palm, a finger and the palm, neighbouring fingers [m]."""
STUMP_END = 0.020
"""How far behind the wrist joint the hand ends [m]."""
STUMP_ROUNDING = 0.007
"""Of the edge there [m]."""
PALMAR, DORSAL = np.array([0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Limb:
    """A chain of balls and what is between them.

    Attributes:
        points: Centres of the balls [m], shape (N, 3).
        radii: Their radii [m], shape (N,).
    """

    points: Array
    radii: Array

    def distance(self, points: Array) -> Array:
        """Distance of points from the surface, negative inside [m], shape (P,)."""
        nearest = np.full(len(points), np.inf)
        for (start, first), (end, last) in pairwise(zip(self.points, self.radii, strict=True)):
            along = end - start
            share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
            offset = points - start - share[:, None] * along
            length = np.sqrt(np.einsum("pi,pi->p", offset, offset))
            nearest = np.minimum(nearest, length - first - share * (last - first))
        return nearest


@dataclass(frozen=True, eq=False)
class HandForm:
    """The flesh of a right hand in its zero pose.

    Attributes:
        joints: Origins of the links [m], shape (16, 3).
        tips: Fingertips by finger [m].
        fingers: The five fingers, by name.
        palm: The limbs of the palm.
    """

    joints: Array
    tips: dict[str, Array]
    fingers: dict[str, Limb]
    palm: tuple[Limb, ...]

    def distance(self, points: Array) -> Array:
        """About the distance of points from the skin, negative inside [m], shape (P,)."""
        palm = self.palm[0].distance(points)
        for limb in self.palm[1:]:
            palm = _melt(palm, limb.distance(points), PALM_MELT)
        fingers: Array | None = None
        for limb in self.fingers.values():
            distance = limb.distance(points)
            fingers = distance if fingers is None else _melt(fingers, distance, CREASE_MELT)
        assert fingers is not None
        whole = _melt(palm, fingers, FINGER_MELT)
        return -_melt(-whole, STUMP_END - points[:, 0], STUMP_ROUNDING)

    def bounds(self) -> tuple[Array, Array]:
        """Two corners of a box around the hand [m]."""
        limbs = (*self.fingers.values(), *self.palm)
        low = np.min([(limb.points - limb.radii[:, None]).min(axis=0) for limb in limbs], axis=0)
        high = np.max([(limb.points + limb.radii[:, None]).max(axis=0) for limb in limbs], axis=0)
        return low, np.minimum(high, [STUMP_END, np.inf, np.inf])


def hand_form(hand: HandModel) -> HandForm:
    """The flesh of a right hand, as thick as its collision shapes."""
    joints = hand.link_origin
    tips, fingers = {}, {}
    for index, finger in enumerate(FINGERS):
        first = 1 + 3 * index
        tips[finger] = joints[first + 2] + hand.tip_offset[TIP_FINGERS.index(finger)]
        shapes = hand.colliders[first : first + 3]
        radii = [max(shape.radius for shape in link if isinstance(shape, Capsule)) for link in shapes]
        fingers[finger] = _finger(np.stack([*joints[first : first + 3], tips[finger]]), radii, finger == "thumb")
    box = next(shape for shape in hand.colliders[0] if isinstance(shape, Box))
    return HandForm(joints, tips, fingers, _palm(joints, box, fingers))


def _finger(nodes: Array, radii: list[float], is_thumb: bool) -> Limb:
    """A finger along its three joints and its tip: thick at the joints, with pads on the inner side between them."""
    first, second, third = radii
    bend = inner_side(nodes, is_thumb=is_thumb)
    knuckle = 1.0 if is_thumb else 1.08
    end = 0.90 * third
    last = nodes[3] - nodes[2]
    tip = nodes[3] - end * last / np.linalg.norm(last)
    pads = [
        (nodes[0], knuckle * first, 0.0),
        (_between(nodes[0], nodes[1], 0.5), 1.0 * first, 0.0006),
        (nodes[1], 0.53 * (first + second), -0.0004),
        (_between(nodes[1], nodes[2], 0.5), 0.98 * second, 0.0006),
        (nodes[2], 0.52 * (second + third), -0.0002),
        (_between(nodes[2], tip, 0.55), 1.03 * third, 0.0005),
        (tip, end, 0.0006),
    ]
    return Limb(
        np.stack([point + shift * bend for point, _, shift in pads]), np.array([radius for _, radius, _ in pads])
    )


def _palm(joints: Array, box: Box, fingers: dict[str, Limb]) -> tuple[Limb, ...]:
    """The palm, between the wrist and the knuckles."""
    knuckle = {finger: joints[1 + 3 * FINGERS.index(finger)] for finger in FINGERS}
    thick = float(box.extents.min()) / 2
    middle_y = box.position[1]
    broad = float(box.extents[2])
    middle_z = box.position[2]

    def at(x: float, y: float, z: float) -> Array:
        return np.array([x, middle_y + y, middle_z + z])

    limbs = []
    # The forearm's end and the carpus: limbs side by side are an oval.
    for side in (-1, 0, 1):
        limbs.append(
            _limb(
                (at(0.040, 0.000, side * 0.185 * broad), 1.20 * thick),
                (at(0.004, 0.000, side * 0.200 * broad), 1.20 * thick),
                (at(-0.020, 0.000, side * 0.245 * broad), 1.06 * thick),
            )
        )
    # The metacarpals, which fan out.
    for finger in LONG_FINGERS:
        k = knuckle[finger]
        start = at(-0.010, 0.0, 0.0)
        start[2] += 0.5 * (k[2] - middle_z)
        near = _between(start, k, 0.5)
        limbs.append(
            _limb(
                (start, 0.90 * thick), (near, 0.88 * thick), (k + 0.0005 * DORSAL, -0.0005 + fingers[finger].radii[0])
            )
        )
    # The pads: of the little finger, below the knuckles, and of the thumb.
    pinky, index = knuckle["pinky"], knuckle["index"]
    limbs.append(
        _limb(
            (at(-0.014, -0.0035, -0.20 * broad), 0.92 * thick),
            (_between(at(-0.014, -0.0035, -0.24 * broad), pinky, 0.55) + 0.002 * PALMAR, 0.90 * thick),
            (pinky + 0.0015 * PALMAR, 0.62 * thick),
        )
    )
    row = [knuckle[finger] + 0.003 * PALMAR + np.array([0.004, 0.0, 0.0]) for finger in LONG_FINGERS]
    limbs.append(Limb(np.stack(row), np.array([0.62, 0.68, 0.66, 0.50]) * thick))
    thumb = fingers["thumb"]
    base, joint = joints[1 + 3 * FINGERS.index("thumb")], joints[2 + 3 * FINGERS.index("thumb")]
    limbs.append(
        _limb(
            (at(-0.012, -0.003, 0.16 * broad), 1.00 * thick),
            (_between(base, joint, 0.15) + 0.001 * PALMAR, 1.10 * thumb.radii[0]),
            (_between(base, joint, 0.62), 1.04 * thumb.radii[0]),
        )
    )
    # The web of the thumb.
    for share, reach in ((0.35, 0.40), (0.62, 0.60), (0.80, 0.74)):
        outer = _between(base, joint, share)
        inner = _between(at(-0.015, 0.0, 0.22 * broad), index, reach)
        limbs.append(_limb((outer, 0.55 * thick), (_between(outer, inner, 0.5), 0.36 * thick), (inner, 0.55 * thick)))
    # The webs of the fingers.
    for one, other in pairwise(LONG_FINGERS):
        ends = [_between(fingers[name].points[0], fingers[name].points[1], 0.42) for name in (one, other)]
        radius = 0.62 * min(fingers[one].radii[1], fingers[other].radii[1])
        limbs.append(_limb(*((end + 0.0015 * PALMAR, radius) for end in ends)))
    return tuple(limbs)


def inner_side(nodes: Array, *, is_thumb: bool) -> Array:
    """The direction in which the pads of a finger with these joints and tip are, across the finger."""
    along = (nodes[3] - nodes[0]) / np.linalg.norm(nodes[3] - nodes[0])
    # A thumb's nail faces sideways.
    inner = np.array([0.25, -0.65, -0.70]) if is_thumb else PALMAR
    across: Array = inner - (inner @ along) * along
    return across / np.linalg.norm(across)


def _limb(*balls: tuple[Array, float]) -> Limb:
    return Limb(np.stack([point for point, _ in balls]), np.array([radius for _, radius in balls]))


def _between(start: ArrayLike, end: ArrayLike, share: float) -> Array:
    point: Array = (1 - share) * np.asarray(start, float) + share * np.asarray(end, float)
    return point


def _melt(a: Array, b: Array, width: float) -> Array:
    """The smaller of two distances, rounded where they are about equal."""
    overlap = np.maximum(width - np.abs(a - b), 0.0)
    melted: Array = np.minimum(a, b) - overlap**2 / (4 * width)
    return melted
