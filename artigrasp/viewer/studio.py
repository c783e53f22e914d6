"""What everything stands on, is lit by and is looked at from."""

import itertools
from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from viser import DirectionalLightHandle, LabelHandle, SceneApi, ViserServer

from artigrasp.arrays import Array
from artigrasp.assets.object import ObjectModel
from artigrasp.config import StageConfig
from artigrasp.export.camera import HALF_ANGLE, Direction, View, look_at, unit_vector
from artigrasp.kernels.layout import BASE
from artigrasp.motion.kinematics import pose_object
from artigrasp.viewer.appearance import SKY, TABLE, Appearance
from artigrasp.viewer.conventions import to_wxyz
from artigrasp.viewer.recording import Track

THICKNESS, BEVEL = 0.03, 0.006
"""Of the table top [m]."""
SIZE, BORDER = np.array([0.9, 1.2]), 0.3
"""Least size of the table, and how much there is around what happens on it [m]."""
APART = 0.7
"""How far apart things stand that are shown side by side [m]."""
TURN, TURN_BESIDE, ELEVATION = np.radians(40.0), np.radians(15.0), np.radians(30.0)
"""Of the camera from the side where the hands are, if one thing or several are shown, and above the horizon [rad]."""
ASPECT = 1.15
"""Width over height of the part of a browser's window that the panel leaves free."""
DISTANCE = 1.1
"""Of the camera over that at which everything just fits."""
ASIDE = 0.4
"""How far left of the middle of the window it is, over half the window's height."""
LABEL_GAP = 0.06
"""Between what is shown and its label [m]."""
LOOKS = 12
"""Samples of a recording that are looked at to see where it happens."""
SIDE_LIGHT, BACK_LIGHT = (np.radians(50.0), np.radians(30.0)), (np.radians(170.0), np.radians(40.0))
"""Directions of the weaker lights from the camera's: about the vertical, and above the horizon [rad]."""


class Studio:
    """Table, lights, background and camera."""

    def __init__(self, server: ViserServer) -> None:
        """Prepare what does not change."""
        self._server, self._scene, self._casts_shadows = server, server.scene, True
        self._labels: list[LabelHandle] = []
        self._key: DirectionalLightHandle | None = None
        self._scene.set_up_direction("+z")
        self._scene.configure_default_lights(enabled=False)
        self._scene.configure_environment_map(None)
        self._scene.set_background_image(_gradient(), format="png")
        self._scene.add_light_hemisphere(
            "/light/sky", sky_color=(250, 252, 255), ground_color=(205, 185, 165), intensity=1.55
        )

    def set_up(self, tracks: Sequence[Track]) -> Array:
        """Make room for tracks, and look at them from the side of their hands.

        Several of them get their labels in front of them.

        Returns:
            Where to put the origins of their worlds [m], shape ``[track, 3]``.
        """
        found = [_places(track) for track in tracks]
        front = np.sum([front for _, front in found], axis=0)
        azimuth = float(np.arctan2(front[1], front[0])) if np.hypot(*front[:2]) > 1e-3 else -np.pi / 2
        along = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        row = APART * (np.arange(len(tracks)) - (len(tracks) - 1) / 2)
        offsets: Array = row[:, None] * along
        points = np.concatenate([places + offset for (places, _), offset in zip(found, offsets, strict=True)])
        self._label(tracks, found, offsets, front)
        self._lay_table(points, azimuth)
        self._look(points, (azimuth + (TURN if len(tracks) == 1 else TURN_BESIDE), ELEVATION))
        return offsets

    def _label(
        self, tracks: Sequence[Track], found: Sequence[tuple[Array, Array]], offsets: Array, front: Array
    ) -> None:
        """Say in front of each of several tracks what it is."""
        for label in self._labels:
            label.remove()
        self._labels = []
        towards = np.array([*front[:2], 0.0]) / max(float(np.hypot(*front[:2])), 1e-6)
        for index, (track, (places, _), offset) in enumerate(zip(tracks, found, offsets, strict=True)):
            if len(tracks) > 1:
                place = places.mean(axis=0) + (np.max((places - places.mean(axis=0)) @ towards) + LABEL_GAP) * towards
                label = self._scene.add_label(
                    f"/label{index}",
                    track.label,
                    position=(*(place + offset)[:2], 0.0),
                    anchor="top-center",
                    font_screen_scale=0.9,
                )
                self._labels.append(label)

    def appear(self, appearance: Appearance) -> None:
        """Light it as the panel says."""
        self._casts_shadows = appearance.fine
        if self._key is not None:
            self._key.cast_shadow = appearance.fine

    def _lay_table(self, points: Array, azimuth: float) -> None:
        """Put a table below some points, an edge of it towards an azimuth."""
        turn = Rotation.from_euler("z", azimuth)
        local = turn.inv().apply(points)[:, :2]
        low = np.minimum(local.min(axis=0) - BORDER, -SIZE / 2)
        high = np.maximum(local.max(axis=0) + BORDER, SIZE / 2)
        self._scene.add_mesh_simple(
            "/table",
            *_bevelled(np.array([*(high - low), THICKNESS])),
            color=TABLE,
            position=turn.apply([*(low + high) / 2, -THICKNESS / 2]),
            wxyz=to_wxyz(turn.as_quat()),
            cast_shadow=False,
        )

    def _look(self, points: Array, direction: Direction) -> None:
        """Put camera and lights where they show some points from a direction."""
        view = look_at(points, direction, ASPECT)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        distance = DISTANCE * float(np.linalg.norm(view.position - middle))
        # the panel covers the right of the window
        target = middle + ASIDE * distance * view.right / ASPECT
        position = target - distance * view.forward
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.fov = position, target, float(2 * HALF_ANGLE)
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = position, target
        self._light(view, direction)

    def _light(self, view: View, direction: Direction) -> None:
        add = self._scene.add_light_directional
        self._key = add(
            "/light/key",
            color=(255, 246, 232),
            intensity=2.6,
            cast_shadow=self._casts_shadows,
            position=tuple(2 * view.sun),
        )
        for name, colour, intensity, (turn, elevation) in (
            ("side", (235, 240, 255), 0.7, SIDE_LIGHT),
            ("back", (255, 255, 255), 0.5, BACK_LIGHT),
        ):
            place = 2 * unit_vector((direction[0] + turn, elevation))
            add(f"/light/{name}", color=colour, intensity=intensity, position=tuple(place))


def add_plateau(scene: SceneApi, name: str, stage: StageConfig) -> None:
    """Add a plateau that stands on the table, below a node of the scene."""
    vertices, faces = _bevelled(np.array([*stage.size, stage.height]))
    scene.add_mesh_simple(name, vertices, faces, color=TABLE, position=(*stage.position, stage.height / 2))


def _places(track: Track) -> tuple[Array, Array]:
    """Points around all that a track shows, shape ``[N, 3]``, and the direction from objects to hands."""
    points: list[NDArray[np.floating]] = []
    front = np.zeros(3)
    for time in np.linspace(0.0, track.recording.duration, LOOKS):
        sample = track.recording.at(float(time))
        links = sample.link_poses[..., :3].reshape(-1, 3)
        boxes = [_box(object, poses) for object, poses in zip(track.objects, sample.part_poses, strict=True)]
        front += links.mean(axis=0) - boxes[0].mean(axis=0)
        points += [links, *boxes]
    aim = track.aim
    if aim is not None and aim.angle is not None:
        # what is recorded yet may not reach it
        object, angle = track.objects[0], np.array([aim.angle])
        base = track.recording.at(0.0).part_poses[0, BASE] if aim.object_pose is None else aim.object_pose
        points.append(_box(object, pose_object(base[None], angle, object)[0]))
    return np.concatenate(points).astype(float), front


def _box(object: ObjectModel, part_poses: NDArray[np.floating]) -> Array:
    """Corners around the parts of an object at these poses, shape ``[16, 3]``."""
    return np.concatenate(
        [
            Rotation.from_quat(pose[3:]).apply(_corners(part.vertices)) + pose[:3]
            for part, pose in zip(object.parts, part_poses, strict=True)
        ]
    )


def _corners(vertices: Array) -> Array:
    bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)], axis=1)
    return np.array(list(itertools.product(*bounds)))


def _bevelled(extents: Array) -> tuple[Array, NDArray[np.int64]]:
    """A slab whose edges are cut off, with vertices of their own for every facet."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * extents
    inward = [corners - np.sign(corners) * BEVEL * (1 - np.eye(3)[axis]) for axis in range(3)]
    hull = trimesh.Trimesh(np.concatenate(inward)).convex_hull
    hull.unmerge_vertices()
    return np.asarray(hull.vertices), np.asarray(hull.faces)


def _gradient() -> NDArray[np.uint8]:
    top, bottom = (np.array(colour, float) for colour in SKY)
    share = np.linspace(0, 1, 256)[:, None, None]
    image = (1 - share) * top + share * bottom
    return np.broadcast_to(image.round().astype(np.uint8), (256, 4, 3)).copy()
