"""The skin of a hand: a mesh without gaps that bends with the links."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array

SKIN_COLOUR = (0.74, 0.40, 0.27)
"""Linear RGB of a hand where one colour has to do."""


@dataclass(frozen=True, eq=False)
class HandSkin:
    """A closed surface that follows the links of a hand by linear blend skinning.

    Attributes:
        vertices: In the hand's zero pose, in the frame of the wrist link [m], shape (V, 3).
        faces: Vertex indices, counter-clockwise seen from outside, shape (F, 3).
        weights: How much of each link's motion a vertex takes part in, shape (V, 16); they add up to 1.
        colours: Linear RGB of the vertices, each 0 to 1, shape (V, 3).
        link_origin: Origins of the links in the zero pose, in the frame of the wrist link [m], shape (16, 3).
    """

    vertices: Array
    faces: NDArray[np.int32]
    weights: Array
    colours: Array
    link_origin: Array

    def posed(self, link_poses: NDArray[np.floating]) -> Array:
        """The vertices where links have these poses.

        Args:
            link_poses: Of the links in any frame: position [m], quaternion xyzw, shape ``[..., 16, 7]``.

        Returns:
            In the same frame [m], shape ``[..., V, 3]``.
        """
        leading = link_poses.shape[:-2]
        turns = Rotation.from_quat(link_poses[..., 3:].reshape(-1, 4)).as_matrix().reshape(*leading, -1, 3, 3)
        moves = link_poses[..., :3] - np.einsum("...lij,lj->...li", turns, self.link_origin)
        turn = np.einsum("vl,...lij->...vij", self.weights, turns)
        posed: Array = np.einsum("...vij,vj->...vi", turn, self.vertices) + self.weights @ moves
        return posed


def mirror_skin(skin: HandSkin) -> HandSkin:
    """The skin of the other hand: the exact mirror image across x = 0."""
    factor = np.array([-1.0, 1.0, 1.0])
    return replace(
        skin,
        vertices=skin.vertices * factor,
        faces=np.ascontiguousarray(skin.faces[:, ::-1]),
        link_origin=skin.link_origin * factor,
    )
