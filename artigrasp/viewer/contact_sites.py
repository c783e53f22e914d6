"""Where hands touch objects: physics tells one force for a link and a part, this is where it is drawn."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_surface import core_points
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import LINK_COUNT

SURFACE_POINTS = 6000
"""Points that stand for the surface of a part."""


class ContactSites:
    """Where links touch parts: the point of the part that is nearest to the link."""

    def __init__(self, hands: Sequence[HandModel], object: ObjectModel) -> None:
        """Prepare for these hands and this object."""
        self._cores = []
        for hand in hands:
            points = core_points(hand)
            self._cores.append([points.position[points.link == link] for link in range(LINK_COUNT)])
        self._points = []
        for part in object.parts:
            mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
            self._points.append(np.asarray(trimesh.sample.sample_surface(mesh, SURFACE_POINTS, seed=0)[0]))
        self._trees = [cKDTree(points) for points in self._points]

    def nearest(
        self, hand: int, link: int, part: int, link_pose: NDArray[np.floating], part_pose: NDArray[np.floating]
    ) -> Array:
        """The point of a part that is nearest to a link, in the part's frame [m], shape ``[3]``.

        Both poses are in one frame: position [m], quaternion xyzw.
        """
        core = Rotation.from_quat(link_pose[3:]).apply(self._cores[hand][link]) + link_pose[:3]
        in_part = Rotation.from_quat(part_pose[3:]).inv().apply(core - part_pose[:3])
        distance, index = self._trees[part].query(in_part)
        found: Array = self._points[part][index[np.argmin(distance)]]
        return found
