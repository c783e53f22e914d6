"""Tests of the meshes that are sent to a browser."""

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.export.surface import part_surface
from artigrasp.kernels.layout import LINK_COUNT
from artigrasp.viewer.meshes import INFLUENCES, creased, links_mesh, skin_mesh


def test_links_are_rigid() -> None:
    """Every vertex of the rigid links follows exactly one link, and all links have some."""
    mesh = links_mesh(load_hand("open", "right"))
    assert set(np.unique(mesh.weights)) == {0.0, 1.0}
    assert (mesh.weights.sum(axis=1) == 1).all() and (mesh.weights.sum(axis=0) > 0).all()


def test_skin_weights() -> None:
    """No vertex of the skin has more links than a browser takes, and their weights add up to 1."""
    mesh = skin_mesh(load_hand("open", "left"))
    assert mesh.weights.shape == (len(mesh.vertices), LINK_COUNT)
    assert ((mesh.weights > 0).sum(axis=1) <= INFLUENCES).all()
    np.testing.assert_allclose(mesh.weights.sum(axis=1), 1.0)


def test_creases_part_vertices() -> None:
    """With the mean normal of its faces at every vertex, a mesh has the corner normals of its surface."""
    surface, _ = part_surface(load_object("lidded-box").parts[0])
    vertices, faces = creased(surface)
    np.testing.assert_allclose(vertices[faces], surface.vertices[surface.faces])
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    mean = np.zeros_like(vertices)
    np.add.at(mean, faces, normals[:, None])
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    assert np.einsum("fci,fci->fc", mean[faces], surface.corner_normals).min() > 0.9
