"""Forces as arrows whose colour is their size, drawn in step with everything else.

Bones of a mesh take effect in the very frame in which a hand's do; viser's own arrows, and colours of instances, come a
frame or more later. So an arrow is a ball, a shaft and a head on two bones, tail and head, and there is a mesh full of
arrows for each colour.
"""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray
from viser import MeshSkinnedHandle, SceneApi

from artigrasp.arrays import Array
from artigrasp.viewer.appearance import FORCE_STEPS, force_colours, force_step
from artigrasp.viewer.conventions import Rgb, to_wxyz

LENGTH = 0.009
"""Of an arrow per newton [m]."""
LONGEST = 0.18
"""Of an arrow [m]."""
BALL, SHAFT, HEAD, HEAD_LENGTH = 0.004, 0.002, 0.0052, 0.012
"""Radii of the ball at the contact, of the shaft and of the head, and the head's length [m]."""
ROOM = 24
"""Arrows of one colour; further ones take the next colour that has room."""
SIDES = 10
"""Of shaft and head."""
NOWHERE = np.array([0.0, 0.0, -10.0])
"""Where arrows wait that are not needed [m]."""
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])


class ForceArrows:
    """Arrows below a node of the scene, for at most ``FORCE_STEPS * ROOM`` forces at once."""

    def __init__(self, scene: SceneApi, name: str) -> None:
        """Add them, none of them in sight."""
        mesh = _arrow_mesh(ROOM)
        self._meshes = [
            _add_arrows(scene, f"{name}/forces{step}", mesh, (int(red), int(green), int(blue)))
            for step, (red, green, blue) in enumerate(force_colours())
        ]
        self._used = [0] * FORCE_STEPS

    @property
    def visible(self) -> bool:
        """Whether they are shown at all."""
        return bool(self._meshes[0].visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        for mesh in self._meshes:
            mesh.visible = visible

    def show(self, starts: Sequence[Array], forces: Sequence[NDArray[np.floating]]) -> None:
        """Show forces [N] that act at points [m], both in the frame of the node."""
        used = [0] * FORCE_STEPS
        for start, force in zip(starts, forces, strict=True):
            size = float(np.linalg.norm(force))
            step = _nearest_with_room(force_step(size), used)
            direction = np.asarray(force, np.float64) / size
            end = start + max(min(LENGTH * size, LONGEST), HEAD_LENGTH) * direction
            self._place(step, used[step], start, end, to_wxyz(_turn_from_z(direction)))
            used[step] += 1
        for step, (before, now) in enumerate(zip(self._used, used, strict=True)):
            for index in range(now, before):
                self._place(step, index, NOWHERE, NOWHERE, to_wxyz(UPRIGHT))
        self._used = used

    def _place(self, step: int, index: int, start: Array, end: Array, wxyz: Array) -> None:
        tail, head = self._meshes[step].bones[2 * index : 2 * index + 2]
        tail.position, head.position = start, end
        tail.wxyz = head.wxyz = wxyz


def _nearest_with_room(step: int, used: Sequence[int]) -> int:
    """The colour that is nearest to one in the scale and has room for another arrow."""
    free = [other for other, count in enumerate(used) if count < ROOM]
    return min(free, key=lambda other: abs(other - step))


def _turn_from_z(direction: Array) -> Array:
    """The shortest rotation that takes z to a unit vector, xyzw."""
    x, y, z = direction
    if z < -0.999999:
        return np.array([1.0, 0.0, 0.0, 0.0])
    turn = np.array([-y, x, 0.0, 1.0 + z])
    return np.asarray(turn / np.linalg.norm(turn))


def _arrow_mesh(count: int) -> tuple[Array, NDArray[np.int64], Array]:
    """Vertices of arrows at rest along z [m], faces, and the bone of each vertex as weights, shape ``[V, 2 count]``.

    The tail carries the ball and one end of the shaft, the head the other end and a cone whose tip is the arrow's.
    """
    ball = trimesh.creation.icosphere(subdivisions=1, radius=BALL)
    cone = trimesh.creation.cone(HEAD, HEAD_LENGTH, sections=SIDES)
    # at rest the head is away from the tail, or the browser would find the shaft's normals inside out
    cone.apply_translation([0.0, 0.0, LONGEST - HEAD_LENGTH])
    around = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    ring = SHAFT * np.stack([np.cos(around), np.sin(around), np.zeros(SIDES)], axis=1)
    here = np.arange(SIDES)
    onward = np.roll(here, -1)
    sides = np.concatenate(
        [np.stack([here, onward, SIDES + onward], axis=1), np.stack([here, SIDES + onward, SIDES + here], axis=1)]
    )
    head_end = ring + np.array([0.0, 0.0, LONGEST - HEAD_LENGTH])
    vertices, faces, bones = [], [], []
    offset = 0
    for index in range(count):
        for points, triangles, of_head in (
            (ball.vertices, ball.faces, np.zeros(len(ball.vertices), np.int64)),
            (np.concatenate([ring, head_end]), sides, np.repeat([0, 1], SIDES)),
            (cone.vertices, cone.faces, np.ones(len(cone.vertices), np.int64)),
        ):
            vertices.append(points)
            faces.append(triangles + offset)
            bones.append(2 * index + of_head)
            offset += len(points)
    return np.concatenate(vertices), np.concatenate(faces), np.eye(2 * count)[np.concatenate(bones)]


def _add_arrows(
    scene: SceneApi, name: str, mesh: tuple[Array, NDArray[np.int64], Array], colour: Rgb
) -> MeshSkinnedHandle:
    vertices, faces, weights = mesh
    handle = scene.add_mesh_skinned(
        name,
        vertices,
        faces,
        bone_wxyzs=np.tile(to_wxyz(UPRIGHT), (weights.shape[1], 1)),
        bone_positions=np.tile([[0.0, 0.0, 0.0], [0.0, 0.0, LONGEST]], (ROOM, 1)),
        skin_weights=weights,
        color=colour,
        cast_shadow=False,
        receive_shadow=False,
    )
    for bone in handle.bones:
        bone.position = NOWHERE
    return handle
