"""Closing a mesh, so that it encloses a volume."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from artigrasp.assets.object_model import Indices, Mesh


def open_edges(mesh: Mesh) -> int:
    """The number of edges that are not shared by exactly two faces; a watertight mesh has none."""
    edges = np.sort(_half_edges(mesh), axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] != 2).sum())


def close_holes(mesh: Mesh) -> Mesh:
    """The mesh with a fan of triangles over each of its holes; the same mesh if it has none.

    Edges at which the surface only touches itself are no holes: every pass over them has a return.
    """
    half_edges = _half_edges(mesh)
    edges, index, counts = np.unique(np.sort(half_edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    passes = np.zeros(len(edges), np.int64)
    np.add.at(passes, index, np.where(half_edges[:, 0] < half_edges[:, 1], 1, -1))
    rim = (counts % 2 == 1) & (passes != 0)
    if not rim.any():
        return mesh
    forward = passes[rim] > 0
    # Each rim edge is passed once more, the other way.
    start, end = np.where(forward, edges[rim].T[::-1], edges[rim].T)
    vertex_count = len(mesh.vertices)
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(vertex_count, vertex_count))
    labels: NDArray[np.int64] = connected_components(graph, directed=False)[1]
    holes, hole = np.unique(labels[start], return_inverse=True)
    centres = np.stack([mesh.vertices[start[hole == each]].mean(axis=0) for each in range(len(holes))])
    fans: Indices = np.stack([start, end, vertex_count + hole], axis=1)
    return Mesh(np.concatenate([mesh.vertices, centres]), np.concatenate([mesh.faces, fans]))


def _half_edges(mesh: Mesh) -> Indices:
    """The three edges of every face, in the direction in which it passes them, shape (3F, 2)."""
    edges: Indices = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return edges
