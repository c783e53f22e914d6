"""A hinged object in the scene, and its ghost at the target."""

import numpy as np
from numpy.typing import NDArray
from viser import FrameHandle, MeshHandle, SceneApi

from artigrasp.assets.object import ObjectModel, PartModel
from artigrasp.export.surface import Surface, part_surface
from artigrasp.kernels.layout import ARTICULATED, BASE, PARTS
from artigrasp.viewer.appearance import GHOST, PIECES, TARGET_GHOST, Appearance
from artigrasp.viewer.conventions import Rgb, to_srgb, to_wxyz
from artigrasp.viewer.meshes import creased


class ObjectFigure:
    """The two parts of an object, each a node that everything that rides on the part hangs below.

    Attributes:
        parts: Names of these nodes, in the order of ``PARTS``.
    """

    def __init__(self, scene: SceneApi, name: str, object: ObjectModel) -> None:
        """Add its surface below a node of the scene."""
        self._scene, self._object = scene, object
        self.parts = tuple(f"{name}/{part}" for part in PARTS)
        self._frames = [scene.add_frame(part, show_axes=False) for part in self.parts]
        self._surfaces = [
            surface
            for frame, part in zip(self.parts, object.parts, strict=True)
            for surface in _add_part(scene, f"{frame}/surface", part)
        ]
        self._pieces: list[MeshHandle] = []

    def appear(self, appearance: Appearance) -> None:
        """Show it as the panel says."""
        if appearance.colliders and not self._pieces:
            self._pieces = self._add_pieces()
        for surface in self._surfaces:
            surface.visible = appearance.object and not appearance.colliders
        for piece in self._pieces:
            piece.visible = appearance.object and appearance.colliders

    def pose(self, part_poses: NDArray[np.floating]) -> None:
        """Move its parts to these poses in the frame of the node (position [m], quaternion xyzw), shape ``[2, 7]``."""
        for frame, pose in zip(self._frames, part_poses, strict=True):
            place(frame, pose)

    def _add_pieces(self) -> list[MeshHandle]:
        pieces = [
            (frame, piece) for frame, part in zip(self.parts, self._object.parts, strict=True) for piece in part.pieces
        ]
        return [
            self._scene.add_mesh_simple(
                f"{frame}/piece{number}",
                piece.vertices,
                piece.faces,
                color=PIECES[number % len(PIECES)],
                flat_shading=True,
            )
            for number, (frame, piece) in enumerate(pieces)
        ]


class TargetGhost:
    """An object at its target: the articulated part alone, or with the base."""

    def __init__(
        self,
        scene: SceneApi,
        name: str,
        object: ObjectModel,
        angle: float,
        *,
        with_base: bool,
        colour: Rgb = TARGET_GHOST,
    ) -> None:
        """Add it as a node that is in the base's frame."""
        self._frame = scene.add_frame(name, show_axes=False)
        position, orientation = object.articulated_pose_in_base(angle)
        articulated = scene.add_frame(f"{name}/articulated", show_axes=False)
        place(articulated, np.concatenate([position, orientation]))
        self._meshes = _add_part(scene, f"{name}/articulated/surface", object.parts[ARTICULATED], colour)
        if with_base:
            self._meshes += _add_part(scene, f"{name}/base", object.parts[BASE], colour)

    def pose(self, pose: NDArray[np.floating]) -> None:
        """Move it to where its base should be: position [m], quaternion xyzw."""
        place(self._frame, pose)

    def appear(self, appearance: Appearance) -> None:
        """Show it as the panel says."""
        self._frame.visible = appearance.target_ghost > 0
        for mesh in self._meshes:
            mesh.opacity = max(appearance.target_ghost, 0.01)

    def remove(self) -> None:
        """Take it away."""
        self._frame.remove()


def place(frame: FrameHandle, pose: NDArray[np.floating]) -> None:
    """Move a node to a pose: position [m], quaternion xyzw."""
    frame.position = pose[:3]
    frame.wxyz = to_wxyz(pose[3:])


def _add_part(scene: SceneApi, name: str, part: PartModel, ghost: Rgb | None = None) -> list[MeshHandle]:
    """Add the surface of a part, a mesh for each of its colours, or in a single one as a ghost."""
    surface, colours = part_surface(part)
    palette, of_face = np.unique(colours, axis=0, return_inverse=True)
    if ghost is not None:
        palette, of_face = palette[:1], np.zeros(len(colours), np.int64)
    meshes = []
    for index, colour in enumerate(palette):
        chosen = of_face.ravel() == index
        vertices, faces = creased(Surface(surface.vertices, surface.faces[chosen], surface.corner_normals[chosen]))
        meshes.append(
            scene.add_mesh_simple(
                f"{name}{index}",
                vertices,
                faces,
                color=to_srgb(colour) if ghost is None else ghost,
                opacity=None if ghost is None else GHOST,
                cast_shadow=ghost is None,
                receive_shadow=ghost is None,
            )
        )
    return meshes
