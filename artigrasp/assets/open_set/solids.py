"""The solids that open objects are made of, each with what is seen of it and the convex pieces that collide.

Everything is a loft: a skin over rings of points, one above the other. A slab has rounded corners and edges, a lathe is
round, a tube follows a path, a shell is hollow. Pieces are coarse lofts of the same rings, convex by construction.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.object_model import Colour, Indices, Mesh

Axis = Literal["x", "y", "z"]

_PLACES: dict[Axis, tuple[int, int, int]] = {"x": (2, 0, 1), "y": (1, 2, 0), "z": (0, 1, 2)}
"""Which of (first side, second side, along the axis) each coordinate is: cyclic, so that faces stay outwards."""
_EDGE_STEPS = 2
"""Of a rounded edge that is seen."""
_ROUND_STEPS = 8
"""Of a quarter of a circle that is seen, at most."""
_ROUND_STEP = 0.004
"""Length of a step of a rounded corner [m]."""


@dataclass(frozen=True, eq=False)
class Solid:
    """One solid of a part.

    Attributes:
        shown: Its surface, watertight.
        pieces: Convex pieces that collide; none of a detail that is only seen.
        colour: Of its surface.
        density: Relative to the other solids of its part.
    """

    shown: Mesh
    pieces: tuple[Mesh, ...]
    colour: Colour
    density: float = 1.0

    def moved(self, offset: ArrayLike = (0, 0, 0), rotation: Rotation | None = None) -> "Solid":
        """The solid, first turned about the origin, then moved [m]."""
        turn = rotation or Rotation.identity()

        def move(mesh: Mesh) -> Mesh:
            return Mesh(turn.apply(mesh.vertices) + np.asarray(offset, float), mesh.faces)

        return replace(self, shown=move(self.shown), pieces=tuple(map(move, self.pieces)))


def detail(solid: Solid) -> Solid:
    """The solid as something that is only seen: a label, a key, a lamp."""
    return replace(solid, pieces=())


def slab(
    low: ArrayLike,
    high: ArrayLike,
    colour: Colour,
    *,
    corner: float = 0.004,
    edge: float = 0.0015,
    axis: Axis = "z",
    density: float = 1.0,
) -> Solid:
    """A box between two corners, rounded: a cylinder if ``corner`` is half its sides.

    Args:
        low: Least coordinates [m], shape (3,).
        high: Largest coordinates [m], shape (3,).
        colour: Of the surface.
        corner: Radius of its outline's corners, seen along the axis [m].
        edge: Radius of the edges around its two ends [m].
        axis: The direction along which it has its outline.
        density: Relative to the other solids of the part.
    """
    places = _PLACES[axis]
    first, second, along = (places.index(each) for each in range(3))
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, size = (low + high) / 2, high - low
    corner = min(corner, size[first] / 2, size[second] / 2)
    edge = min(edge, size[along] / 2, corner or edge)

    def outline(steps: int) -> tuple[Array, Array]:
        points, normals = _rounded_rectangle(size[first], size[second], corner, steps)
        return points + middle[[first, second]], normals

    seen_steps = int(np.clip(np.ceil(corner * np.pi / 2 / _ROUND_STEP), 1, _ROUND_STEPS))
    shown = _prism(*outline(seen_steps if corner else 0), low[along], high[along], edge, _EDGE_STEPS)
    piece = _prism(
        *outline(min(seen_steps, 3) if corner > 0.01 else min(seen_steps, 1)), low[along], high[along], edge, 1
    )
    return Solid(_turn(shown, places), (_turn(piece, places),), colour, density)


def prism(
    corners: ArrayLike,
    low: float,
    high: float,
    colour: Colour,
    *,
    edge: float = 0.0,
    axis: Axis = "z",
    density: float = 1.0,
) -> Solid:
    """A convex polygon given a thickness.

    Args:
        corners: Counter-clockwise seen against the axis, shape (N, 2) [m]: (x, y), (y, z) or (z, x) for z, x or y.
        low: Where it begins along the axis [m].
        high: Where it ends.
        colour: Of the surface.
        edge: Radius of the edges around its two ends [m].
        axis: The direction of the thickness.
        density: Relative to the other solids of the part.
    """
    points = np.asarray(corners, float)
    ahead = np.roll(points, -1, axis=0) - points
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    behind = np.roll(ahead, 1, axis=0)
    mitre = np.stack([ahead[:, 1] + behind[:, 1], -ahead[:, 0] - behind[:, 0]], axis=1)
    # As long as it takes for both sides at a corner to be one unit farther out.
    mitre *= 2 / (mitre**2).sum(axis=1, keepdims=True)
    shown, piece = (_prism(points, mitre, low, high, edge, steps) for steps in (_EDGE_STEPS, 1))
    return Solid(_turn(shown, _PLACES[axis]), (_turn(piece, _PLACES[axis]),), colour, density)


def lathe(
    profile: Sequence[tuple[float, float]],
    colour: Colour,
    *,
    middle: tuple[float, float] = (0.0, 0.0),
    stretch: tuple[float, float] = (1.0, 1.0),
    square: float = 2.0,
    axis: Axis = "z",
) -> Solid:
    """A solid of round sections, or of squarish ones.

    Args:
        profile: Radius and place along the axis [m] of its sections, along the axis; ends are flat.
        colour: Of the surface.
        middle: Of the sections, in the two directions across the axis [m].
        stretch: Of the sections, in these two directions.
        square: Exponent of the superellipse: 2 for circles, more for squarish sections.
        axis: The direction of the axis.
    """

    def rings(sections: Sequence[tuple[float, float]], count: int) -> list[Array]:
        across = _superellipse(_angles(count), square) * np.array(stretch)
        return [_level(radius * across + np.array(middle), place) for radius, place in sections]

    largest = max(radius for radius, _ in profile)
    shown = loft(rings(profile, int(np.clip(2 * np.pi * largest / _ROUND_STEP, 12, 4 * _ROUND_STEPS))))
    pieces = tuple(_turn(loft(rings(run, 16)), _PLACES[axis]) for run in _convex_runs(profile))
    return Solid(_turn(shown, _PLACES[axis]), pieces, colour)


def shell(
    outside: Sequence[tuple[float, float]],
    thickness: float,
    colour: Colour,
    *,
    middle: tuple[float, float] = (0.0, 0.0),
    stretch: tuple[float, float] = (1.0, 1.0),
    square: float = 2.0,
    sectors: int = 12,
    density: float = 1.0,
) -> Solid:
    """A round wall about a vertical axis, open above and below.

    Args:
        outside: Radius and height [m] of its sections, upwards.
        thickness: Of the wall, horizontally [m].
        colour: Of the surface.
        middle: Of the axis [m].
        stretch: Of the sections, in x and y.
        square: Exponent of the superellipse that the sections are.
        sectors: Pieces around it, per pair of sections.
        density: Relative to the other solids of the part.
    """

    def level(radius: float, height: float, angles: Array) -> Array:
        return _level(radius * _superellipse(angles, square) * np.array(stretch) + np.array(middle), height)

    inside = [(radius - thickness, height) for radius, height in outside]
    around = _angles(4 * _ROUND_STEPS)
    shown = _skin([level(*section, around) for section in (*outside, *reversed(inside))], closed=True)
    pieces = []
    for (low_outer, low), (high_outer, high) in itertools.pairwise(outside):
        for sector in range(sectors):
            angles = 2 * np.pi * (sector + np.array([0.0, 0.5, 1.0])) / sectors
            pieces.append(
                loft(
                    [
                        np.concatenate([level(outer, height, angles), level(outer - thickness, height, angles[[2, 0]])])
                        for outer, height in ((low_outer, low), (high_outer, high))
                    ]
                )
            )
    return Solid(shown, tuple(pieces), colour, density)


def tube(path: ArrayLike, radius: float, colour: Colour, *, closed: bool = False, sides: int = 12) -> Solid:
    """A round bar along a path in a plane, each straight stretch of it one piece; its ends are blunt.

    Args:
        path: Points of its middle line [m], shape (N, 3).
        radius: Of the bar [m].
        colour: Of the surface.
        closed: Whether the path goes on from its last point to the first.
        sides: Of its section, as it is seen.
    """
    points = np.asarray(path, float)
    ahead = np.roll(points, -1, axis=0) - points
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    if not closed:
        ahead[-1] = ahead[-2]
    behind = np.roll(ahead, 1, axis=0) if closed else np.concatenate([ahead[:1], ahead[:-1]])
    turns = np.cross(behind, ahead)
    largest = turns[np.linalg.norm(turns, axis=1).argmax()]
    normal = largest if np.linalg.norm(largest) > 1e-6 else np.cross(ahead[0], np.eye(3)[np.abs(ahead[0]).argmin()])
    normal = normal / np.linalg.norm(normal)
    along = ahead + behind
    # Mitred: a section at a bend is as much wider as it is slanted.
    width = 2 / (along**2).sum(axis=1, keepdims=True)
    side = np.cross(normal, along) * width

    def rings(count: int) -> list[Array]:
        # Outwards by a little where there are few sides, so that the area is that of the circle.
        angles = 2 * np.pi * np.arange(count) / count
        reach = radius * np.sqrt(2 * np.pi / count / np.sin(2 * np.pi / count))
        circle = reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return [
            middle + circle[:, :1] * across + circle[:, 1:] * normal
            for middle, across in zip(points, side, strict=True)
        ]

    coarse = rings(8)
    stretches = zip(coarse, [*coarse[1:], coarse[0]], strict=True)
    pieces = [loft(list(pair)) for pair in stretches]
    shown = _skin(rings(sides), closed=True) if closed else loft(rings(sides))
    return Solid(shown, tuple(pieces if closed else pieces[:-1]), colour)


def loft(rings: Sequence[Array]) -> Mesh:
    """A skin over rings of as many points each, shape (N, 3), counter-clockwise seen from the last one; ends closed."""
    skin = _skin(rings, closed=False)
    count, last = len(rings[0]), (len(rings) - 1) * len(rings[0])
    inner = np.arange(1, count - 1)
    bottom = np.stack([np.zeros_like(inner), inner + 1, inner], axis=1)
    top = last + np.stack([np.zeros_like(inner), inner, inner + 1], axis=1)
    return Mesh(skin.vertices, np.concatenate([skin.faces, bottom, top]))


def _skin(rings: Sequence[Array], *, closed: bool) -> Mesh:
    """A skin over rings, open at both ends or leading back to the first ring."""
    count, faces = len(rings[0]), []
    point = np.arange(count)
    ahead = (point + 1) % count
    for index in range(len(rings) if closed else len(rings) - 1):
        here, there = index * count, (index + 1) % len(rings) * count
        faces.append(np.stack([here + point, here + ahead, there + ahead], axis=1))
        faces.append(np.stack([here + point, there + ahead, there + point], axis=1))
    indices: Indices = np.concatenate(faces).astype(np.int64)
    return Mesh(np.concatenate(rings), indices)


def _prism(points: Array, normals: Array, low: float, high: float, edge: float, steps: int) -> Mesh:
    """An outline lofted from low to high; its edges rounded in so many steps: by one, they are bevelled."""
    if edge <= 0:
        return loft([_level(points, low), _level(points, high)])
    angles = np.linspace(0, np.pi / 2, steps + 1)
    inset, rise = edge * (1 - np.sin(angles)), edge * (1 - np.cos(angles))
    if steps == 1:
        # A bevel through the middle of the rounding.
        inset, rise = edge * np.array([0.6, 0.0]), edge * np.array([0.0, 0.6])
    lower = [_level(points - each * normals, low + up) for each, up in zip(inset, rise, strict=True)]
    upper = [_level(points - each * normals, high - down) for each, down in zip(inset, rise, strict=True)]
    # The two meet where the edges are as high as the whole.
    return loft(lower + upper[::-1] if high - low > 2 * edge + 1e-6 else lower + upper[-2::-1])


def _rounded_rectangle(width: float, depth: float, corner: float, steps: int) -> tuple[Array, Array]:
    """Points around the origin, counter-clockwise, and their normals, shape (4 steps + 4, 2) each."""
    if corner <= 0:
        signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], float)
        return signs * np.array([width, depth]) / 2, signs
    points, normals = [], []
    for quarter, (right, back) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angles = np.pi / 2 * (quarter + np.linspace(0, 1, steps + 1))
        normal = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        points.append(np.array([right * (width / 2 - corner), back * (depth / 2 - corner)]) + corner * normal)
        normals.append(normal)
    outline, outwards = np.concatenate(points), np.concatenate(normals)
    # Corners that meet share a point.
    apart = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1) > 1e-6
    return outline[apart], outwards[apart]


def _angles(count: int) -> Array:
    return 2 * np.pi * (np.arange(count) + 0.5) / count


def _superellipse(angles: Array, exponent: float) -> Array:
    """Points of a superellipse of unit radius, shape (N, 2)."""
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points: Array = np.sign(circle) * np.abs(circle) ** (2 / exponent)
    return points


def _level(points: Array, height: float) -> Array:
    return np.concatenate([points, np.full((len(points), 1), height)], axis=1)


def _turn(mesh: Mesh, places: tuple[int, int, int]) -> Mesh:
    return Mesh(mesh.vertices[:, list(places)], mesh.faces)


def _convex_runs(profile: Sequence[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """A profile in runs of sections that are convex together, each of at most four sections."""
    runs = [list(profile[:2])]
    for section in profile[2:]:
        (r0, z0), (r1, z1) = runs[-1][-2:]
        outwards = (r1 - r0) * (section[1] - z1) - (section[0] - r1) * (z1 - z0)
        if outwards >= -1e-12 and len(runs[-1]) < 4:
            runs[-1].append(section)
        else:
            runs.append([(r1, z1), section])
    return runs
