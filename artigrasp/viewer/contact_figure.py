"""Contacts in the scene: forces as arrows coloured by their size, and the points that a reference touches."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation
from viser import BatchedMeshHandle, SceneApi

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import LINK_COUNT
from artigrasp.viewer.appearance import TOUCHED, UNTOUCHED, WEAK, Appearance
from artigrasp.viewer.contact_sites import ContactSites
from artigrasp.viewer.force_arrows import NOWHERE, ForceArrows
from artigrasp.viewer.recording import Aim, Sample

MARK = 0.0045
"""Radius of a target contact [m]."""


class ContactFigure:
    """The contacts of one track."""

    def __init__(
        self,
        scene: SceneApi,
        name: str,
        hands: Sequence[HandModel],
        objects: Sequence[ObjectModel],
        parts: Sequence[str],
    ) -> None:
        """Add what shows them, with room for all that there may be at once.

        Args:
            scene: Of the server.
            name: Of the node of the scene to add it below.
            hands: Models of the hands.
            objects: Models of the objects.
            parts: Names of the nodes of the first object's parts, on which its target contacts ride.
        """
        self._sites = [ContactSites(hands, object) for object in objects]
        self._marks: list[list[tuple[int, int, Array]]] = []
        count = len(hands) * LINK_COUNT
        self._target_dots = [_add_balls(scene, f"{part}/target_contacts", MARK, count) for part in parts]
        self._arrows = ForceArrows(scene, name)
        self._appearance = Appearance()

    def set_aim(self, aim: Aim | None) -> None:
        """Mark the points that a reference touches."""
        self._marks = [[] for _ in self._target_dots]
        self._marked: list[bool] | None = None
        if aim is None or aim.contacts is None:
            return
        at_rest = np.array([0, 0, 0, 0, 0, 0, 1.0])
        for hand, link in np.argwhere(aim.contacts & aim.active[:, None]):
            part = int(aim.part[hand])
            site = self._sites[0].nearest(hand, link, part, aim.link_poses_in_part[hand, link], at_rest)
            self._marks[part].append((int(hand), int(link), site))

    def appear(self, appearance: Appearance) -> None:
        """Show them as the panel says; what changes with time follows with the next sample."""
        self._appearance = appearance
        self._arrows.visible = appearance.contacts
        for dots in self._target_dots:
            dots.visible = appearance.target_contacts

    def show(self, sample: Sample) -> None:
        """Show the contacts of a sample."""
        size = np.linalg.norm(sample.contact_force, axis=-1)
        if self._appearance.contacts:
            self._show_forces(sample, size)
        if self._appearance.target_contacts:
            self._show_marks(size.max(axis=-1) > WEAK)

    def _show_marks(self, touching: NDArray[np.bool_]) -> None:
        """Colour the target contacts by whether the links touch, shape ``[H, 16]``."""
        touched = [bool(touching[hand, link]) for marks in self._marks for hand, link, _ in marks]
        if touched == self._marked:
            return
        self._marked = touched
        for dots, marks in zip(self._target_dots, self._marks, strict=True):
            colours = [TOUCHED if touching[hand, link] else UNTOUCHED for hand, link, _ in marks]
            _show_balls(dots, [site for _, _, site in marks], colours)

    def _show_forces(self, sample: Sample, size: NDArray[np.floating]) -> None:
        starts, forces = [], []
        for hand, link, part in np.argwhere(size > WEAK):
            part_pose = sample.part_poses[sample.focus, part]
            site = self._sites[sample.focus].nearest(hand, link, part, sample.link_poses[hand, link], part_pose)
            starts.append(place(site, part_pose))
            forces.append(sample.contact_force[hand, link, part])
        self._arrows.show(starts, forces)


def place(point: Array, pose: NDArray[np.floating]) -> Array:
    """A point of a frame where that frame's pose (position [m], quaternion xyzw) is given."""
    moved: Array = Rotation.from_quat(pose[3:]).apply(point) + pose[:3]
    return moved


def _add_balls(scene: SceneApi, name: str, radius: float, capacity: int) -> BatchedMeshHandle:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    return scene.add_batched_meshes_simple(
        name,
        np.asarray(ball.vertices),
        np.asarray(ball.faces),
        batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (capacity, 1)),
        batched_positions=np.tile(NOWHERE, (capacity, 1)),
        batched_colors=np.zeros((capacity, 3), np.uint8),
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )


def _show_balls(handle: BatchedMeshHandle, places: Sequence[Array], colours: Sequence[ArrayLike]) -> None:
    positions, colour_rows = np.tile(NOWHERE, (len(handle.batched_positions), 1)), handle.batched_colors.copy()
    if places:
        positions[: len(places)], colour_rows[: len(places)] = np.array(places), np.array(colours)
    handle.batched_positions = positions.astype(np.float32)
    handle.batched_colors = colour_rows
