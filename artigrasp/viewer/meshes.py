"""Triangle meshes as viser takes them: it shades smoothly across shared vertices."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.export.hand_surface import skin_of
from artigrasp.export.subdivision import subdivide
from artigrasp.export.surface import Surface, link_surface
from artigrasp.kernels.layout import LINK_COUNT

INFLUENCES = 4
"""Links that may move one vertex."""


@dataclass(frozen=True, eq=False)
class SkinnedMesh:
    """A mesh whose vertices follow the links of a hand.

    Attributes:
        vertices: In the hand's zero pose, in the frame of the wrist link [m], shape ``[V, 3]``.
        faces: Vertex indices, shape ``[F, 3]``.
        weights: How much of each link's motion a vertex takes part in, shape ``[V, 16]``; at most ``INFLUENCES`` of a
            vertex are not zero, and they add up to 1.
        link_origin: Origins of the links in the zero pose [m], shape ``[16, 3]``.
    """

    vertices: Array
    faces: NDArray[np.int64]
    weights: Array
    link_origin: Array


def skin_mesh(hand: HandModel, *, fine: bool = True) -> SkinnedMesh:
    """A hand in its skin, if ``fine`` refined once so that its outline is round."""
    skin = skin_of(hand)
    vertices, faces, weights = skin.vertices, skin.faces, skin.weights.astype(np.float64)
    if fine:
        refine, faces = subdivide(faces)
        vertices, weights = refine @ vertices, refine @ weights
    np.put_along_axis(weights, np.argsort(weights, axis=1)[:, :-INFLUENCES], 0.0, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    return SkinnedMesh(vertices, faces.astype(np.int64), weights, skin.link_origin)


def links_mesh(hand: HandModel) -> SkinnedMesh:
    """The rigid links of a hand that collide: every vertex follows its own link."""
    origins = hand.link_origin
    vertices, faces, weights, count = [], [], [], 0
    for link in range(LINK_COUNT):
        of_vertices, of_faces = creased(link_surface(hand, link))
        vertices.append(of_vertices + origins[link])
        faces.append(of_faces + count)
        weights.append(np.tile(np.eye(LINK_COUNT)[link], (len(of_vertices), 1)))
        count += len(of_vertices)
    return SkinnedMesh(np.concatenate(vertices), np.concatenate(faces), np.concatenate(weights), origins)


def creased(surface: Surface) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and faces of a surface, vertices parted where their faces meet in a crease."""
    corners = np.concatenate([surface.faces.reshape(-1, 1), np.round(surface.corner_normals.reshape(-1, 3), 3)], axis=1)
    found, corner = np.unique(corners, axis=0, return_inverse=True)
    return surface.vertices[found[:, 0].astype(np.int64)], corner.reshape(-1, 3)
