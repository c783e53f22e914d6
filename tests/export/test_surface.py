"""Tests of the surfaces that are shown."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import Box, Capsule, load_hand
from artigrasp.export.surface import Surface, join, link_surface, mesh_surface, place
from artigrasp.kernels.layout import LINK_COUNT


def face_normals(surface: Surface) -> np.ndarray:
    """Geometric normals of the faces."""
    a, b, c = surface.vertices[surface.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_edges_of_a_box_stay_sharp() -> None:
    """The corners of a box's faces have the normals of the faces."""
    box = trimesh.creation.box((1, 2, 3))
    surface = mesh_surface(box.vertices, box.faces)
    np.testing.assert_allclose(surface.corner_normals, np.repeat(face_normals(surface)[:, None], 3, axis=1), atol=1e-12)


def test_a_ball_is_smooth() -> None:
    """The normals of a ball point away from its centre, also where its vertices are doubled."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    surface = mesh_surface(ball.triangles.reshape(-1, 3), np.arange(3 * len(ball.faces)).reshape(-1, 3))
    assert len(surface.vertices) == len(ball.vertices)
    np.testing.assert_allclose(surface.corner_normals, surface.vertices[surface.faces], atol=0.02)


@pytest.mark.parametrize("side", ["left", "right"])
def test_links_are_their_colliders(side: str) -> None:
    """Every surface point is on or in a collider of its link, and reaches to the ends of it."""
    hand = load_hand("open", side)
    for link in range(LINK_COUNT):
        surface = link_surface(hand, link)
        distance = np.full(len(surface.vertices), np.inf)
        for collider in hand.colliders[link]:
            local = Rotation.from_quat(collider.orientation).inv().apply(surface.vertices - collider.position)
            if isinstance(collider, Capsule):
                core, radius = np.array([0, 0, collider.length / 2]), collider.radius
            else:
                assert isinstance(collider, Box)
                core, radius = collider.extents / 2, 0.0
            outside = np.linalg.norm(np.maximum(np.abs(local) - core, 0), axis=1) - radius
            distance = np.minimum(distance, outside)
            assert (local.max(axis=0) > core + radius - 1e-3).all()
            assert (local.min(axis=0) < -core - radius + 1e-3).all()
        assert distance.max() < 1e-6
        facing = np.einsum("ijk,ik->ij", surface.corner_normals, face_normals(surface))
        assert facing.min() > 0.7


def test_place_and_join() -> None:
    """Surfaces keep their shape where they are put, and their faces when put together."""
    box = trimesh.creation.box((1, 2, 3))
    surface = mesh_surface(box.vertices, box.faces)
    pose = np.array([1.0, 2.0, 3.0, *Rotation.from_euler("z", 90, degrees=True).as_quat()])
    both = join([surface, place(surface, pose)])
    mesh = trimesh.Trimesh(both.vertices, both.faces, process=False)
    assert mesh.volume == pytest.approx(12)
    np.testing.assert_allclose(mesh.bounds, [[-0.5, -1, -1.5], [2, 2.5, 4.5]], atol=1e-12)
    np.testing.assert_allclose(both.corner_normals[:, 0], mesh.face_normals, atol=1e-12)
