"""Contacts in the scene: forces as arrows coloured by their size, and the points that a reference touches."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from viser import BatchedMeshHandle, SceneApi

from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_surface import core_points
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import LINK_COUNT, PARTS
from artigrasp.viewer.appearance import TOUCHED, UNTOUCHED, WEAK, Appearance, force_colours
from artigrasp.viewer.recording import Aim, Sample

Array = NDArray[np.float64]

SURFACE_POINTS = 6000
"""Points that stand for the surface of a part."""
LENGTH = 0.009
"""Of an arrow per newton [m]."""
LONGEST = 0.18
"""Of an arrow [m]."""
DOT, MARK = 0.0035, 0.0045
"""Radii of a contact point and of a target contact [m]."""

NOWHERE = np.array([[0.0, 0.0, -10.0], [0.0, 0.0, -10.01]])
"""Where balls and arrows wait that are not needed, start and end [m]: their number must not change."""


class ContactSites:
    """Where links touch parts: the point of the part that is nearest to the link.

    The physics tells one force for a link and a part; this is where it is drawn.
    """

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
        capacity = len(hands) * LINK_COUNT * len(PARTS)
        self._dots = _add_balls(scene, f"{name}/contacts", DOT, capacity)
        count = len(hands) * LINK_COUNT
        self._target_dots = [_add_balls(scene, f"{part}/target_contacts", MARK, count) for part in parts]
        self._arrows = scene.add_arrows(
            f"{name}/forces",
            np.tile(NOWHERE, (capacity, 1, 1)),
            np.zeros((capacity, 3), np.uint8),
            shaft_radius=0.0016,
            head_radius=0.004,
            head_length=0.009,
        )
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
        self._dots.visible = self._arrows.visible = appearance.contacts
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
        touching = np.argwhere(size > WEAK)
        starts, arrows = [], np.tile(NOWHERE, (size.size, 1, 1))
        colours = np.zeros((size.size, 3), np.uint8)
        for row, (hand, link, part) in enumerate(touching):
            part_pose = sample.part_poses[sample.focus, part]
            site = self._sites[sample.focus].nearest(hand, link, part, sample.link_poses[hand, link], part_pose)
            start = place(site, part_pose)
            force = sample.contact_force[hand, link, part]
            length = min(LENGTH * size[hand, link, part], LONGEST)
            arrows[row] = start, start + length * force / size[hand, link, part]
            starts.append(start)
        colours[: len(touching)] = force_colours(size[tuple(touching.T)])
        self._arrows.points, self._arrows.colors = arrows.astype(np.float32), colours
        _show_balls(self._dots, starts, list(colours[: len(touching)]))


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
        batched_positions=np.tile(NOWHERE[0], (capacity, 1)),
        batched_colors=np.zeros((capacity, 3), np.uint8),
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )


def _show_balls(handle: BatchedMeshHandle, places: Sequence[Array], colours: Sequence[ArrayLike]) -> None:
    positions, colour_rows = np.tile(NOWHERE[0], (len(handle.batched_positions), 1)), handle.batched_colors.copy()
    if places:
        positions[: len(places)], colour_rows[: len(places)] = np.array(places), np.array(colours)
    handle.batched_positions = positions.astype(np.float32)
    handle.batched_colors = colour_rows
