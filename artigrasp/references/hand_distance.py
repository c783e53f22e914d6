"""How far the surfaces of posed hands are from the surfaces of hinged objects, differentiably and in batches."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_surface import HandPoints, core_points
from artigrasp.assets.hand_table import hand_table, put_hands
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels import mesh_distance, states
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.layout import ARTICULATED, BASE, LINK_COUNT, PARTS

REACH = 0.1
"""How far to look for a part's surface by default [m]; what is farther counts as that far."""
BATCH = 256
"""Worlds that :func:`link_distances` measures at a time."""


class PartMeshes:
    """The surfaces of the parts of objects on a device.

    Attributes:
        device: Warp device.
        ids: Ids of the meshes by object and part, uint64, shape [object, 2].
    """

    def __init__(self, objects: Sequence[ObjectModel], device: str) -> None:
        """Copy the surfaces to a device."""
        self.device = device
        self.ids = np.zeros((len(objects), len(PARTS)), np.uint64)
        self._meshes = []
        for index, model in enumerate(objects):
            for part, of in enumerate(model.parts):
                vertices = wp.array(of.vertices.astype(np.float32), dtype=wp.vec3, device=device)
                faces = wp.array(of.faces.astype(np.int32).ravel(), dtype=int, device=device)
                self._meshes.append(wp.Mesh(vertices, faces, support_winding_number=True))
                self.ids[index, part] = self._meshes[-1].id


def points_table(hands: Sequence[HandPoints], device: str) -> mesh_distance.HandPoints:
    """Points of all hands as kernels take them; a hand with fewer points repeats its last one."""
    count = max(len(each.link) for each in hands)
    rows = [np.minimum(np.arange(count), len(each.link) - 1) for each in hands]

    def gather(name: str, dtype: object) -> wp.array:
        values = np.stack([getattr(each, name)[row] for each, row in zip(hands, rows, strict=True)])
        return wp.array(values.astype(np.int32 if dtype is int else np.float32), dtype=dtype, device=device)

    table = mesh_distance.HandPoints()
    table.position, table.radius, table.link = gather("position", wp.vec3), gather("radius", float), gather("link", int)
    first = [np.searchsorted(each.link, np.arange(LINK_COUNT + 1)) for each in hands]
    table.first = wp.array(np.stack(first).astype(np.int32), dtype=int, device=device)
    return table


class HandDistance:
    """Distances between hands and objects in W worlds.

    Fill ``hands.joint_q``, ``hands.hand_base`` and ``part_pose`` and call :meth:`launch`; with ``requires_grad`` a tape
    around that leads from ``distance`` back to all three.

    Attributes:
        hands: State of the hands, whose joint coordinates and base frames are the input.
        hand_model: Offsets and limits of the hands.
        points: The points of the hands.
        part_pose: Frames of the parts, in the frame that the hand bases are given in, shape [world, 2].
        position: Centres of the points, in that frame [m], shape [world, hand, point].
        closest: Closest point of each part to every point, in the part's frame [m], shape [world, hand, point, 2].
        normal: Gradient of the signed distance there in the part's frame, zero out of reach, same shape.
        distance: Signed distances of the balls around the points from each part [m], negative where they overlap, shape
            [world, hand, point, 2].
        nearest: The nearest point of each link, int, shape [world, hand, 16, 2].
        link_distance: Its distance [m], without gradient, shape [world, hand, 16, 2].
    """

    def __init__(
        self,
        hands: Sequence[HandModel],
        meshes: PartMeshes,
        object_index: NDArray[np.integer],
        *,
        points: Sequence[HandPoints] | None = None,
        reach: float = REACH,
        requires_grad: bool = False,
    ) -> None:
        """Allocate.

        Args:
            hands: The hands of every world.
            meshes: The surfaces of the objects, on the device to use.
            object_index: Each world's object among them, shape [world].
            points: Points of each hand; by default :func:`artigrasp.assets.hand_surface.core_points`.
            reach: How far to look for a surface [m].
            requires_grad: Whether to differentiate.
        """
        device = self.device = meshes.device
        self.reach = reach
        world_count, hand_count = len(object_index), len(hands)
        self.points = points_table(points or [core_points(hand) for hand in hands], device)
        self.hands = states.hand_state(world_count, hand_count, device, requires_grad)
        self.hand_model = hand_table(hands, device)
        # A mesh lives as long as its Python object.
        self._meshes = meshes
        self._mesh = wp.array(meshes.ids[object_index], dtype=wp.uint64, device=device)
        self.part_pose = wp.zeros(
            (world_count, len(PARTS)), dtype=wp.transform, device=device, requires_grad=requires_grad
        )
        shape = (world_count, *self.points.radius.shape)
        self.position = wp.zeros(shape, dtype=wp.vec3, device=device, requires_grad=requires_grad)
        shape = (*shape, len(PARTS))
        self.closest, self.normal = (wp.zeros(shape, dtype=wp.vec3, device=device) for _ in range(2))
        self.distance = wp.zeros(shape, dtype=float, device=device, requires_grad=requires_grad)
        shape = (world_count, hand_count, LINK_COUNT, len(PARTS))
        self.nearest = wp.zeros(shape, dtype=int, device=device)
        self.link_distance = wp.zeros(shape, dtype=float, device=device)

    def launch(self) -> None:
        """Pose the hands and measure."""
        hands = self.position.shape[:2]
        wp.launch(forward_kinematics, dim=hands, inputs=[self.hands, self.hand_model], device=self.device)
        wp.launch(
            mesh_distance.place_points,
            dim=self.position.shape,
            inputs=[self.hands.link_pose, self.points],
            outputs=[self.position],
            device=self.device,
        )
        wp.launch(
            mesh_distance.find_closest_points,
            dim=self.distance.shape,
            inputs=[self._mesh, self.part_pose, self.position, self.reach],
            outputs=[self.closest, self.normal],
            device=self.device,
            record_tape=False,
        )
        wp.launch(
            mesh_distance.signed_distances,
            dim=self.distance.shape,
            inputs=[self.part_pose, self.position, self.points.radius, self.closest, self.normal, self.reach],
            outputs=[self.distance],
            device=self.device,
        )
        wp.launch(
            mesh_distance.nearest_of_link,
            dim=self.nearest.shape,
            inputs=[self.points, self.distance],
            outputs=[self.nearest, self.link_distance],
            device=self.device,
            record_tape=False,
        )


def link_distances(
    model: ObjectModel,
    hands: Sequence[HandModel],
    wrist_pose_in_base: NDArray[np.floating],
    finger_angles: NDArray[np.floating],
    hinge_angle: NDArray[np.floating],
    *,
    reach: float = REACH,
) -> NDArray[np.float32]:
    """Signed distance of the surface of every link from each part, in N configurations of hands and object.

    Args:
        model: The object.
        hands: The hands, H of them.
        wrist_pose_in_base: Wrist frames in the base's frame: position [m], quaternion xyzw, shape [N, H, 7].
        finger_angles: Finger angles [rad], shape [N, H, 45].
        hinge_angle: Hinge angles [rad], shape [N].
        reach: How far to look for a surface [m]; what is farther counts as that far, less the radius of a finger.

    Returns:
        Distances [m], negative where a link is inside or overlaps the part, shape [N, H, 16, 2].
    """
    count = len(hinge_angle)
    meshes = PartMeshes([model], "cpu")
    result = np.zeros((count, len(hands), LINK_COUNT, len(PARTS)), np.float32)
    bounds = [*range(0, count, BATCH), count]
    for start, end in pairwise(bounds):
        distance = HandDistance(hands, meshes, np.zeros(end - start, int), reach=reach)
        put_hands(distance.hands, wrist_pose_in_base[start:end], finger_angles[start:end])
        distance.part_pose.assign(pose_parts_in_base(model, hinge_angle[start:end]))
        distance.launch()
        result[start:end] = distance.link_distance.numpy()
    return result


def pose_parts_in_base(model: ObjectModel, hinge_angle: NDArray[np.floating]) -> NDArray[np.float32]:
    """Frames of both parts in the base's at hinge angles [rad]: position [m], quaternion xyzw, shape [N, 2, 7]."""
    poses = np.zeros((len(hinge_angle), len(PARTS), 7), np.float32)
    poses[:, BASE, 6] = 1.0
    for row, angle in enumerate(hinge_angle):
        poses[row, ARTICULATED] = np.concatenate(model.articulated_pose_in_base(float(angle)))
    return poses
