"""How closely convex pieces follow the mesh that they were cut from."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from artigrasp.arrays import Array
from artigrasp.assets.holes import close_holes, open_edges
from artigrasp.assets.object_model import Mesh, crossed_edges

GRID_CELLS = 250_000
"""Cells of the grid on which a volume is measured, to about 1 %."""
_MOST_CELLS_ALONG = 2_000
"""Cells along one of its axes."""
SAMPLES = 4000
"""Points on each surface from which distances are measured."""
TRIANGLES_PER_SURFACE = 40_000
"""Into about how many small triangles a surface is divided."""
CANDIDATES = 16
"""Small triangles among which the nearest to a point is sought: those whose middles are nearest."""
SLIT = 5e-4
"""Gaps between pieces that are narrower than this are not seen [m]."""


@dataclass(frozen=True)
class Fidelity:
    """How closely pieces follow a mesh.

    Attributes:
        pieces: Number of pieces.
        open_edges: Edges of the mesh that are not shared by two faces: with any, its holes are closed by a guess.
        volume_ratio: Volume of the pieces' union over that of the mesh.
        outward_median_mm: Median distance from the surface of the union to the mesh.
        outward_p95_mm: What 95 % of these distances are below.
        inward_median_mm: Median distance from the mesh to the surface of the union.
        inward_p95_mm: What 95 % of these distances are below.
    """

    pieces: int
    open_edges: int
    volume_ratio: float
    outward_median_mm: float
    outward_p95_mm: float
    inward_median_mm: float
    inward_p95_mm: float


def measure_fidelity(mesh: Mesh, pieces: tuple[Mesh, ...]) -> Fidelity:
    """Compare the union of convex pieces with the mesh that they stand for, its holes closed."""
    closed = close_holes(mesh)
    hulls = [trimesh.convex.convex_hull(piece.vertices) for piece in pieces]
    of_mesh = _subdivide(closed.vertices[closed.faces])
    of_union = _outer_surface(hulls)
    outward = _distances_mm(_sample(of_union), of_mesh)
    inward = _distances_mm(_sample(of_mesh), of_union)
    return Fidelity(
        pieces=len(pieces),
        open_edges=open_edges(mesh),
        volume_ratio=volume_ratio(closed, pieces),
        outward_median_mm=float(np.median(outward)),
        outward_p95_mm=float(np.quantile(outward, 0.95)),
        inward_median_mm=float(np.median(inward)),
        inward_p95_mm=float(np.quantile(inward, 0.95)),
    )


def volume_ratio(mesh: Mesh, pieces: tuple[Mesh, ...]) -> float:
    """Volume of the union of convex pieces over the volume of a closed mesh, to about 1 %: 1 is a perfect fit."""
    volume = float(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume)
    return union_volume(pieces) / max(abs(volume), 1e-12)


def union_volume(pieces: tuple[Mesh, ...]) -> float:
    """The volume of the union of convex pieces [m³], to about 1 %."""
    corners = np.concatenate([piece.vertices for piece in pieces])
    low, extents = corners.min(axis=0), np.ptp(corners, axis=0)
    # a needle or a plate would take as many cells as it is longer than thick
    edge = max((extents.prod() / GRID_CELLS) ** (1 / 3), extents.max() / _MOST_CELLS_ALONG, 1e-9)
    shape = np.ceil(extents / edge).astype(int)
    # One point at a random place of each cell: a regular grid would over- or undercount walls that are parallel to it.
    points = low + edge * (np.moveaxis(np.indices(shape), 0, -1) + np.random.default_rng(0).random((*shape, 3)))
    inside = np.zeros(shape, bool)
    for piece in pieces:
        hull = trimesh.convex.convex_hull(piece.vertices)
        start = ((hull.bounds[0] - low) / edge - 1).astype(int).clip(0)
        block = tuple(map(slice, start, ((hull.bounds[1] - low) / edge + 2).astype(int)))
        inside[block] |= _is_inside(points[block], hull)
    return float(inside.sum() * edge**3)


def _is_inside(points: Array, hull: trimesh.Trimesh) -> NDArray[np.bool_]:
    """Which points, shape (..., 3), are in a convex hull."""
    within = np.ones(points.shape[:-1], bool)
    for normal, corner in zip(hull.face_normals, hull.triangles[:, 0], strict=True):
        within &= points @ normal <= corner @ normal
    return within


def _outer_surface(hulls: list[trimesh.Trimesh]) -> Array:
    """Small triangles of the surface of the union of convex hulls, without where they meet, shape (N, 3, 3)."""
    triangles = _subdivide(np.concatenate([hull.triangles for hull in hulls]))
    normals = crossed_edges(triangles)
    # A triangle is inside the union if what lies just before it is.
    before = triangles.mean(axis=1) + SLIT * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    covered = np.zeros(len(before), bool)
    for hull in hulls:
        near = np.flatnonzero(((hull.bounds[0] <= before) & (before <= hull.bounds[1])).all(axis=1))
        covered[near] |= _is_inside(before[near], hull)
    return triangles[~covered]


def _subdivide(triangles: Array) -> Array:
    """Halve the longest edges until a surface has about so many small triangles of similar size, shape (N, 3, 3)."""
    areas = np.linalg.norm(crossed_edges(triangles), axis=1) / 2
    longest = 2.0 * np.sqrt(areas.sum() / TRIANGLES_PER_SURFACE)
    done = []
    while len(triangles):
        lengths = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        small = lengths.max(axis=1) <= longest
        done.append(triangles[small])
        rest = triangles[~small]
        # Turn each triangle so that its longest edge is the first one.
        start = lengths[~small].argmax(axis=1)[:, None]
        first, second, third = np.moveaxis(
            np.take_along_axis(rest, ((start + np.arange(3)) % 3)[:, :, None], axis=1), 1, 0
        )
        middle = (first + second) / 2
        triangles = np.concatenate([np.stack([first, middle, third], 1), np.stack([middle, second, third], 1)])
    return np.concatenate(done)


def _sample(triangles: Array) -> Array:
    """Points spread evenly over triangles, shape (SAMPLES, 3)."""
    random = np.random.default_rng(0)
    areas = np.linalg.norm(crossed_edges(triangles), axis=1)
    chosen = triangles[random.choice(len(triangles), SAMPLES, p=areas / areas.sum())]
    points: Array = np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), SAMPLES), chosen)
    return points


def _distances_mm(points: Array, triangles: Array) -> Array:
    """Distance **[mm]** of points from a surface of small triangles of similar size, shape (N,)."""
    # In millimetres also because trimesh takes triangles of a size of millimetres, in metres, for points.
    points, triangles = 1000 * points, 1000 * triangles
    _, nearest = cKDTree(triangles.mean(axis=1)).query(points, k=min(CANDIDATES, len(triangles)))
    nearest = nearest.reshape(len(points), -1)
    count = nearest.shape[1]
    closest_point: Any = trimesh.triangles.closest_point
    closest = closest_point(triangles[nearest.ravel()], np.repeat(points, count, axis=0))
    distances: Array = np.linalg.norm(closest.reshape(-1, count, 3) - points[:, None], axis=2).min(axis=1)
    return distances
