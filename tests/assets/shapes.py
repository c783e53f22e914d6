"""Shapes that tests of meshes share."""

import numpy as np
import trimesh

from artigrasp.assets.object import Mesh


def corner() -> Mesh:
    """An L of two boards as one watertight mesh, which no single convex piece fits."""
    outline = [(0, 0), (0.1, 0), (0.1, 0.02), (0.02, 0.02), (0.02, 0.1), (0, 0.1)]
    triangles = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    solid = trimesh.creation.extrude_triangulation(np.array(outline), np.array(triangles), 0.05)
    return Mesh(np.array(solid.vertices), np.array(solid.faces))


def box(extents: tuple[float, float, float] = (0.12, 0.10, 0.08)) -> Mesh:
    """A box around the origin."""
    solid = trimesh.creation.box(extents)
    return Mesh(np.array(solid.vertices), np.array(solid.faces))


def hull(mesh: Mesh) -> Mesh:
    """The convex hull of a mesh."""
    solid = trimesh.convex.convex_hull(mesh.vertices)
    return Mesh(np.array(solid.vertices), np.array(solid.faces))
