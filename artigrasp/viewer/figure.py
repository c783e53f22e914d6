"""One track in the scene: hands, object, contacts and ghosts."""

from collections.abc import Sequence

import numpy as np
from viser import MeshSkinnedHandle, SceneApi

from artigrasp.kernels.layout import BASE
from artigrasp.viewer.appearance import GHOST, REFERENCE_GHOST, Appearance
from artigrasp.viewer.contact_figure import ContactFigure
from artigrasp.viewer.hand_figure import HandFigure, add_hand, pose_bones
from artigrasp.viewer.object_figure import ObjectFigure, TargetGhost
from artigrasp.viewer.recording import Aim, Sample, Track
from artigrasp.viewer.studio import add_plateau


class Figure:
    """Draws the samples of tracks that have the same hands and the same object."""

    def __init__(self, scene: SceneApi, name: str, track: Track) -> None:
        """Add it to the scene; :meth:`set_track` says what to draw.

        Args:
            scene: Of the server.
            name: Of its node.
            track: One of these tracks.
        """
        self._scene, self._name, self._track = scene, name, track
        self._root = scene.add_frame(name, show_axes=False)
        self._objects = [
            ObjectFigure(scene, f"{name}/object{index}", object) for index, object in enumerate(track.objects)
        ]
        if track.stage is not None:
            add_plateau(scene, f"{name}/stage", track.stage)
        self._hands = [HandFigure(scene, f"{name}/{hand.side}", hand) for hand in track.hands]
        self._contacts = ContactFigure(scene, name, track.hands, track.objects, self._objects[0].parts)
        self._ghosts: dict[tuple[int, int], MeshSkinnedHandle] = {}
        self._target: TargetGhost | None = None
        self._appearance = Appearance()
        self._aim: Aim | None = None
        self._shown: Sample | None = None

    @staticmethod
    def key(track: Track) -> tuple[str, ...]:
        """What two tracks have in common that one figure can draw."""
        return (
            *(str(object.path) for object in track.objects),
            *(str(hand.path) for hand in track.hands),
            str(track.stage),
        )

    def set_track(self, track: Track) -> None:
        """Draw another track, which has the same :meth:`key`."""
        self._aim, self._track = track.aim, track
        self._contacts.set_aim(track.aim)
        if self._target is not None:
            self._target.remove()
            self._target = None
        if track.aim is not None and track.aim.angle is not None:
            # where the base may be anywhere, the target rides on it
            goal = track.aim.object_pose
            name = f"{self._objects[0].parts[BASE] if goal is None else self._name}/target"
            self._target = TargetGhost(self._scene, name, track.objects[0], track.aim.angle, with_base=goal is not None)
            if goal is not None:
                self._target.pose(goal)
        self.appear(self._appearance)

    def appear(self, appearance: Appearance) -> None:
        """Show it as the panel says."""
        self._appearance = appearance
        for object in self._objects:
            object.appear(appearance)
        for hand in self._hands:
            hand.appear(appearance)
        self._contacts.appear(appearance)
        if self._target is not None:
            self._target.appear(appearance)
        self._show_ghosts()
        if self._shown is not None:
            self.show(self._shown)

    def show(self, sample: Sample) -> None:
        """Draw a sample."""
        self._shown = sample
        for object, part_poses in zip(self._objects, sample.part_poses, strict=True):
            object.pose(part_poses)
        for figure, poses in zip(self._hands, sample.link_poses, strict=True):
            figure.pose(poses)
        self._contacts.show(sample)

    def place(self, offset: Sequence[float]) -> None:
        """Show it with the world's origin there [m]."""
        self._root.position = tuple(offset)
        self._root.visible = True

    def hide(self) -> None:
        """Leave it out of the picture.

        There is no taking it away: viser 1.1 breaks a page from which it removes a mesh with bones.
        """
        self._root.visible = False

    def _show_ghosts(self) -> None:
        """Show the hands of the reference, each below the part that it manipulates."""
        wanted = set()
        if self._appearance.reference_ghost > 0 and self._aim is not None and self._aim.needs_ghost:
            wanted = {(hand, int(self._aim.part[hand])) for hand in np.flatnonzero(self._aim.active).tolist()}
        for hand, part in wanted - set(self._ghosts):
            name = f"{self._objects[0].parts[part]}/reference_{self._track.hands[hand].side}"
            mesh = self._hands[hand].mesh("coarse skin")
            self._ghosts[hand, part] = add_hand(self._scene, name, mesh, REFERENCE_GHOST, GHOST)
        for (hand, part), ghost in self._ghosts.items():
            ghost.visible = (hand, part) in wanted
            if ghost.visible and self._aim is not None:
                ghost.opacity = self._appearance.reference_ghost
                pose_bones(ghost, self._aim.link_poses_in_part[hand])
