"""Somebody's idea of a grip: which fingertips go where on the surface, and how the hand is turned.

A hand comes to the surface with the pads of its long fingers on one face, in a row, and its thumb, where it has one to
press against, on another: across the object, or around a corner. All in the base's frame.
"""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from artigrasp.arrays import Array
from artigrasp.kernels.layout import BASE, TIP_COUNT, TIP_FINGERS
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.surface import SurfacePoints

ROW = np.array([0.018, 0.024, 0.002, -0.019, -0.038])
"""Where the fingertips are across the hand, towards the thumb [m], order ``TIP_FINGERS``."""
WIDEST, LATERAL = 0.085, 0.03
"""How far apart the pads of thumb and fingers may be, and by how much they may miss each other sideways [m]."""
PATCH = 0.015
"""A finger has something to touch if the surface is no farther from where it would be in the row [m]."""
OPPOSED, ALIKE = -0.6, 0.7
"""Cosines between normals of faces across an object at most, and of one face at least."""
FINGER_COUNTS, FINGER_SHARES = (2, 3, 4), (0.2, 0.3, 0.5)
"""How many long fingers are busy, and how often."""
BENDS = (0.2, 1.4)
"""Range of the angle between the palm and the pads of the fingers [rad]."""
THUMB = TIP_FINGERS.index("thumb")


@dataclass(frozen=True, eq=False)
class Intents:
    """N intents of H hands.

    Attributes:
        target: Point of the surface that each fingertip is meant for [m], order ``TIP_FINGERS``, shape (N, H, 5, 3).
        normal: Unit outward normal there, shape (N, H, 5, 3).
        part: Index of the part there, shape (N, H, 5).
        busy: Which fingertips are meant for something, shape (N, H, 5).
        across: Unit vector across the hand, from the little finger to the thumb, shape (N, H, 3).
        bend: Angle between the palm and the pads of the long fingers [rad], shape (N, H).
    """

    target: Array
    normal: Array
    part: NDArray[np.int64]
    busy: NDArray[np.bool_]
    across: Array
    bend: Array

    def __len__(self) -> int:
        return len(self.bend)

    def __getitem__(self, rows: NDArray[np.integer]) -> Self:
        """Some of the intents."""
        return type(self)(**{each.name: getattr(self, each.name)[rows] for each in fields(self)})


def draw_intents(grip: Grip, resting: RestingObject, surface: SurfacePoints, count: int, seed: int) -> Intents | None:
    """Draw intents of a grip.

    Args:
        grip: What hands are to do.
        resting: The object.
        surface: Its points that fingers can come to.
        count: Intents.
        seed: Of the draw.

    Returns:
        The intents, or None if the object has nothing to do this with.
    """
    random = np.random.default_rng(seed)
    if len(grip.sides) == 2:
        return _draw_pairs(resting, surface, count, random)
    wanted = surface.opening if grip.kind == "articulate" else _graspable(resting, surface)
    thumb = _thumb_places(surface, same_part=grip.kind == "articulate", corners=grip.kind == "articulate")
    # Fingers may rest where the thumb opens best.
    through_thumb = np.array([0.7 * wanted[each].max(initial=0.0) for each in thumb])
    weight = np.maximum(wanted, through_thumb) ** 2
    if grip.kind == "grasp":
        weight = weight * np.array([len(each) > 0 for each in thumb])
    if weight.sum() <= 0:
        return None
    anchors = random.choice(len(weight), count, p=weight / weight.sum())
    drawn = []
    for anchor in anchors:
        turn = random.uniform(0, 2 * np.pi)
        first = _across(surface.normal[anchor], resting.up)
        across = np.cos(turn) * first + np.sin(turn) * np.cross(surface.normal[anchor], first)
        places = thumb[anchor]
        if len(places):
            sideways = np.abs((surface.position[places] - surface.position[anchor]) @ across - ROW[THUMB])
            places = places[np.argsort(sideways)[: max(1, len(places) // 4)]]
        opposed = int(random.choice(places)) if len(places) else None
        drawn.append(_draw_hand(surface, int(anchor), across, opposed, random))
    return _stack([[each] for each in drawn])


def _graspable(resting: RestingObject, surface: SurfacePoints) -> Array:
    """How good a place on the base is to carry the object by: the nearer to its centre of mass the better."""
    distance = np.linalg.norm(surface.position - resting.com, axis=1)
    return np.where(surface.part == BASE, np.exp(-((distance / 0.12) ** 2)), 0.0)


def _thumb_places(surface: SurfacePoints, *, same_part: bool, corners: bool) -> list[NDArray[np.int64]]:
    """For every point the points where a thumb can press against fingers that are there."""
    tree = KDTree(surface.position)
    places = []
    for anchor, near in enumerate(tree.query_ball_point(surface.position, WIDEST)):
        rows = np.array(near)
        offset = surface.position[rows] - surface.position[anchor]
        along = -offset @ surface.normal[anchor]
        sideways = np.linalg.norm(offset + along[:, None] * surface.normal[anchor], axis=1)
        slant = surface.normal[rows] @ surface.normal[anchor]
        fits = (slant < OPPOSED) & (along > 0) & (sideways < LATERAL)
        if corners and not fits.any():
            fits = (np.abs(slant) < 0.3) & (np.linalg.norm(offset, axis=1) > 0.03)
        if same_part:
            fits &= surface.part[rows] == surface.part[anchor]
        places.append(rows[fits])
    return places


def _draw_pairs(
    resting: RestingObject, surface: SurfacePoints, count: int, random: np.random.Generator
) -> Intents | None:
    """Hands on opposite sides of an object, as of somebody who stands before it, wherever that may be."""
    right = np.flatnonzero(_graspable(resting, surface) > 0)
    if not len(right):
        return None
    level = np.abs(surface.normal[right] @ resting.up) < 0.5
    right = right[level]
    drawn: list[list[dict[str, Any]]] = []
    for _ in range(20 * count):
        if len(drawn) == count or not len(right):
            break
        anchor = random.choice(right)
        offset = surface.position[right] - surface.position[anchor]
        distance = np.linalg.norm(offset, axis=1)
        direction = offset / np.maximum(distance, 1e-9)[:, None]
        miss = np.linalg.norm(np.cross(resting.com - surface.position[anchor], direction), axis=1)
        fits = (surface.normal[right] @ surface.normal[anchor] < OPPOSED) & (distance > 0.04) & (miss < 0.05)
        fits &= (-direction @ surface.normal[anchor] > 0.85) & (np.abs(offset @ resting.up) < 0.04)
        if not fits.any():
            continue
        other = random.choice(right[fits])
        aside = surface.position[anchor] - surface.position[other]
        ahead = np.cross(resting.up, aside / np.linalg.norm(aside))
        # The thumbs are up, or ahead where the fingers point down.
        turn = random.uniform(-0.4, 1.7)
        hands = []
        for row in (other, anchor):
            angle = turn + random.normal(0, 0.15)
            across = np.cos(angle) * resting.up + np.sin(angle) * ahead
            across -= (across @ surface.normal[row]) * surface.normal[row]
            across /= np.linalg.norm(across)
            hands.append(_draw_hand(surface, int(row), across, None, random))
        drawn.append(hands)
    if not drawn:
        return None
    return _stack([drawn[index % len(drawn)] for index in range(count)])


def _draw_hand(
    surface: SurfacePoints, anchor: int, across: Array, thumb: int | None, random: np.random.Generator
) -> dict[str, Any]:
    """One hand whose middle finger is meant for a point, and whose thumb for another one, or for nothing."""
    normal = surface.normal[anchor]
    hand: dict[str, Any] = {
        "target": np.tile(surface.position[anchor], (TIP_COUNT, 1)),
        "normal": np.tile(normal, (TIP_COUNT, 1)),
        "part": np.full(TIP_COUNT, surface.part[anchor]),
        "busy": np.zeros(TIP_COUNT, bool),
        "across": across,
        "bend": random.uniform(*BENDS),
    }
    count = random.choice(FINGER_COUNTS, p=FINGER_SHARES)
    alike = np.flatnonzero((surface.part == surface.part[anchor]) & (surface.normal @ normal > ALIKE))
    for tip in range(1, 1 + count):
        place = surface.position[anchor] + (ROW[tip] - ROW[2]) * across
        distance = np.linalg.norm(surface.position[alike] - place, axis=1)
        nearest = alike[distance.argmin()]
        if distance.min() < PATCH:
            there = surface.normal[nearest]
            hand["target"][tip] = place - ((place - surface.position[nearest]) @ there) * there
            hand["normal"][tip], hand["busy"][tip] = there, True
    if thumb is not None:
        hand["target"][THUMB], hand["normal"][THUMB] = surface.position[thumb], surface.normal[thumb]
        hand["part"][THUMB], hand["busy"][THUMB] = surface.part[thumb], True
    return hand


def _stack(drawn: list[list[dict[str, Any]]]) -> Intents:
    """Intents of hands [N][H]."""
    names = [each.name for each in fields(Intents)]
    return Intents(**{name: np.array([[hand[name] for hand in hands] for hands in drawn]) for name in names})


def _across(normal: Array, up: Array) -> Array:
    """A unit vector across a normal, as level as can be."""
    level = np.cross(normal, up)
    if np.linalg.norm(level) < 1e-3:
        level = np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0])
    return np.asarray(level / np.linalg.norm(level))
