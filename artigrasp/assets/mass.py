"""Masses of parts of which only the shape is known."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import trimesh

from artigrasp.arrays import Array
from artigrasp.assets.fidelity import union_volume
from artigrasp.assets.holes import close_holes
from artigrasp.assets.object_model import Mesh


class Body(NamedTuple):
    """Mass [kg], centre of mass [m], shape (3,), and inertia about it [kg·m²], shape (3, 3)."""

    mass: float
    com: Array
    inertia: Array


def join_bodies(bodies: Sequence[Body]) -> Body:
    """All bodies as one."""
    masses = np.array([body.mass for body in bodies])
    com: Array = masses @ np.array([body.com for body in bodies]) / masses.sum()
    inertia = np.zeros((3, 3))
    for body in bodies:
        offset = body.com - com
        inertia += body.inertia + body.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return Body(float(masses.sum()), com, inertia)


def body_of_mesh(mesh: Mesh, pieces: tuple[Mesh, ...], density: float) -> Body:
    """The body of a density [kg/m³] that a mesh encloses, its holes closed; where it is tangled, that of its pieces."""
    closed = close_holes(mesh)
    solid: Any = trimesh.Trimesh(closed.vertices, closed.faces, process=False)
    if solid.is_watertight and solid.is_winding_consistent:
        volume = abs(float(solid.volume))
    else:
        solid = trimesh.util.concatenate([trimesh.convex.convex_hull(piece.vertices) for piece in pieces])
        volume = union_volume(pieces)
    # Per volume as it stands, whichever way the faces look and however pieces overlap.
    inertia: Array = np.array(solid.moment_inertia) / float(solid.volume)
    mass = density * volume
    return Body(mass, np.array(solid.center_mass), mass * inertia)
