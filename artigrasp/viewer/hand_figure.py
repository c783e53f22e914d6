"""A hand in the scene, in its skin or as rigid links; and one that only stands there, as a ghost."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from viser import MeshSkinnedHandle, SceneApi

from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_skin import SKIN_COLOUR
from artigrasp.viewer.appearance import Appearance
from artigrasp.viewer.conventions import Rgb, to_srgb, to_wxyz
from artigrasp.viewer.meshes import SkinnedMesh, links_mesh, skin_mesh

_MESHES: dict[str, Callable[[HandModel], SkinnedMesh]] = {
    "skin": skin_mesh,
    "coarse skin": partial(skin_mesh, fine=False),
    "links": links_mesh,
}


class HandFigure:
    """A hand that moves; its meshes are sent once, then only the poses of its links are."""

    def __init__(self, scene: SceneApi, name: str, hand: HandModel) -> None:
        """Make it below a node of the scene, at first without any mesh."""
        self._scene, self._name, self._hand = scene, name, hand
        self._meshes: dict[str, SkinnedMesh] = {}
        self._drawn: dict[str, MeshSkinnedHandle] = {}
        self._shown: MeshSkinnedHandle | None = None
        self._poses: NDArray[np.floating] | None = None

    def mesh(self, look: str) -> SkinnedMesh:
        """Its mesh, made on first use."""
        if look not in self._meshes:
            self._meshes[look] = _MESHES[look](self._hand)
        return self._meshes[look]

    def appear(self, appearance: Appearance) -> None:
        """Show it as the panel says."""
        look = "coarse skin" if appearance.hands == "skin" and not appearance.fine else appearance.hands
        opacity = None if appearance.hand_opacity >= 1.0 else appearance.hand_opacity
        if look in _MESHES and look not in self._drawn:
            name = f"{self._name}/{look.replace(' ', '_')}"
            self._drawn[look] = add_hand(self._scene, name, self.mesh(look), to_srgb(SKIN_COLOUR), opacity)
        self._shown = self._drawn.get(look)
        for handle in self._drawn.values():
            handle.visible = handle is self._shown
            handle.opacity = opacity
        if self._poses is not None:
            self.pose(self._poses)

    def pose(self, link_poses: NDArray[np.floating]) -> None:
        """Move its links to these poses in the frame of the node (position [m], quaternion xyzw), shape ``[16, 7]``."""
        self._poses = link_poses
        if self._shown is not None:
            pose_bones(self._shown, link_poses)


def add_hand(
    scene: SceneApi, name: str, mesh: SkinnedMesh, colour: Rgb, opacity: float | None = None
) -> MeshSkinnedHandle:
    """Add a hand in its zero pose."""
    return scene.add_mesh_skinned(
        name,
        mesh.vertices,
        mesh.faces,
        bone_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(mesh.link_origin), 1)),
        bone_positions=mesh.link_origin,
        skin_weights=mesh.weights,
        color=colour,
        opacity=opacity,
        cast_shadow=opacity is None,
        receive_shadow=opacity is None,
    )


def pose_bones(handle: MeshSkinnedHandle, link_poses: NDArray[np.floating]) -> None:
    """Move the links of a hand to these poses (position [m], quaternion xyzw), shape ``[16, 7]``."""
    for bone, position, wxyz in zip(handle.bones, link_poses[:, :3], to_wxyz(link_poses[:, 3:]), strict=True):
        bone.position = position
        bone.wxyz = wxyz
