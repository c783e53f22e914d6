"""From where hands on an object are seen best."""

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.object_model import crossed_edges
from artigrasp.export.camera import Direction, unit_vector
from artigrasp.export.raycaster import visibility
from artigrasp.export.surface import Surface

AZIMUTHS = 24
ELEVATIONS: dict[float, float] = {10.0: 0.85, 28.0: 1.0, 50.0: 0.9}
"""Heights of the camera above the horizon that are tried [deg], and what a view from there is worth."""
LEAST_TURN = np.radians(60.0)
"""Between the azimuths of two views [rad]."""
POINTS = 2000
"""Faces that are looked at."""


def telling_directions(scene: Surface, weights: Array, count: int) -> list[Direction]:
    """Directions from which most of what matters in a scene is seen, each adding most to those before it.

    Args:
        scene: All that is there, world [m].
        weights: How much a square metre of each face matters, shape ``[F]``.
        count: Number of directions, 1 or 2.
    """
    directions = [
        (float(azimuth), float(np.radians(elevation)))
        for elevation in ELEVATIONS
        for azimuth in 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    ]
    worth = np.repeat(list(ELEVATIONS.values()), AZIMUTHS)
    triangles = scene.vertices[scene.faces]
    normals = crossed_edges(triangles)
    areas = np.linalg.norm(normals, axis=1)
    importance = weights * areas
    # Faces drawn by their importance stand for all.
    chosen = np.random.default_rng(0).choice(len(areas), POINTS, p=importance / importance.sum())
    seen = visibility(
        scene,
        triangles[chosen].mean(axis=1),
        normals[chosen] / areas[chosen, None],
        np.array([unit_vector(direction) for direction in directions]),
    )
    found: list[Direction] = []
    so_far = np.zeros(POINTS)
    azimuths = np.array([azimuth for azimuth, _ in directions])
    allowed = np.ones(len(directions), bool)
    for _ in range(count):
        gain = np.where(allowed, worth * np.maximum(seen, so_far).sum(axis=1), -np.inf)
        best = int(gain.argmax())
        found.append(directions[best])
        so_far = np.maximum(so_far, seen[best])
        allowed &= np.abs((azimuths - azimuths[best] + np.pi) % (2 * np.pi) - np.pi) >= LEAST_TURN - 1e-6
    return found
