"""How a hand looks: in its skin, or as the rigid links that collide."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_skin import SKIN_COLOUR, HandSkin
from artigrasp.assets.object_model import crossed_edges
from artigrasp.assets.skin_drawing import draw_skin
from artigrasp.export.subdivision import subdivide
from artigrasp.export.surface import Surface, join, link_surface, place
from artigrasp.kernels.layout import LINK_COUNT


class HandSurface(Protocol):
    """What a hand looks like, wherever its links are."""

    @property
    def colours(self) -> Array:
        """Linear RGB of the faces, shape ``[F, 3]``."""

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """The surface of links at these poses (position [m], quaternion xyzw), shape ``[16, 7]``."""

    def of_faces(self, of_links: Array) -> Array:
        """What the faces have of something that the links have, shape ``[16, ...]`` to ``[F, ...]``."""


def hand_surface(hand: HandModel, *, rigid: bool = False) -> HandSurface:
    """A hand in its skin, which is drawn now if it has none, or as the rigid links that collide."""
    if rigid:
        return Links(tuple(link_surface(hand, link) for link in range(LINK_COUNT)))
    return Skin(skin_of(hand))


def skin_of(hand: HandModel) -> HandSkin:
    """The skin of a hand, drawn now if it has none."""
    return draw_skin(hand) if hand.skin is None else hand.skin


@dataclass(frozen=True, eq=False)
class Links:
    """The rigid links of a hand, each with the surface of its collision shapes in its own frame."""

    surfaces: tuple[Surface, ...]

    @cached_property
    def colours(self) -> Array:
        """See :attr:`HandSurface.colours`."""
        return np.tile(SKIN_COLOUR, (sum(len(surface.faces) for surface in self.surfaces), 1))

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """See :meth:`HandSurface.posed`."""
        return join([place(surface, pose) for surface, pose in zip(self.surfaces, link_poses, strict=True)])

    def of_faces(self, of_links: Array) -> Array:
        """See :meth:`HandSurface.of_faces`."""
        return np.repeat(of_links, [len(surface.faces) for surface in self.surfaces], axis=0)


@dataclass(frozen=True, eq=False)
class Skin:
    """The skin of a hand, refined once so that its outline is round."""

    skin: HandSkin

    @cached_property
    def _refined(self) -> tuple[csr_array, NDArray[np.int32]]:
        return subdivide(self.skin.faces)

    @cached_property
    def colours(self) -> Array:
        """See :attr:`HandSurface.colours`."""
        return self._mean(self.skin.colours)

    def posed(self, link_poses: NDArray[np.floating]) -> Surface:
        """See :meth:`HandSurface.posed`."""
        matrix, faces = self._refined
        vertices: Array = matrix @ self.skin.posed(link_poses)
        # The normals of the bent surface: bent normals would be too smooth in its folds.
        areas = crossed_edges(vertices[faces])
        normals = np.zeros_like(vertices)
        for corner in faces.T:
            np.add.at(normals, corner, areas)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        return Surface(vertices, faces, normals[faces])

    def of_faces(self, of_links: Array) -> Array:
        """See :meth:`HandSurface.of_faces`."""
        return self._mean(self.skin.weights @ of_links)

    def _mean(self, of_vertices: Array) -> Array:
        """What the refined faces have of something that the vertices have."""
        matrix, faces = self._refined
        found: Array = (matrix @ of_vertices)[faces].mean(axis=1)
        return found
