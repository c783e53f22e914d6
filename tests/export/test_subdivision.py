"""Tests of Loop subdivision."""

import numpy as np
import trimesh

from artigrasp.export.subdivision import subdivide


def test_an_icosahedron_becomes_round() -> None:
    """Every triangle becomes four, the surface stays closed, and all is nearer to a ball than before."""
    ball = trimesh.creation.icosahedron()
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces, np.int32)
    for _ in range(2):
        matrix, fine = subdivide(faces)
        np.testing.assert_allclose(np.asarray(matrix.sum(axis=1)).ravel(), 1)
        assert matrix.min() >= 0 and len(fine) == 4 * len(faces)
        vertices, faces = matrix @ vertices, fine
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    radius = np.linalg.norm(vertices, axis=1)
    assert np.ptp(radius) < 0.03 * radius.mean()


def test_it_agrees_with_trimesh() -> None:
    """A closed mesh of many valences, subdivided by a program that others wrote, is the same set of points."""
    mesh = trimesh.convex.convex_hull(np.random.default_rng(0).normal(size=(40, 3)))
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32)
    theirs, _ = trimesh.remesh.subdivide_loop(vertices, faces, iterations=1)
    ours = subdivide(faces)[0] @ vertices
    order = lambda points: points[np.lexsort(np.round(points, 6).T)]  # noqa: E731
    np.testing.assert_allclose(order(ours), order(np.asarray(theirs)), atol=1e-9)
