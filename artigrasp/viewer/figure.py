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
from artigrasp.viewer.table import add_plateau


class Figure:
    """Draws the samples of tracks that have the same hands and the same object."""

    def __init__(self, scene: SceneApi, name: str, track: Track, offset: Sequence[float]) -> None:
        """Add it to the scene.

        Args:
            scene: Of the server.
            name: Of its node.
            track: What to draw.
            offset: Where the world's origin is put [m].
        """
        self._scene, self._name = scene, name
        self._root = scene.add_frame(name, show_axes=False, position=tuple(offset))
        self._objects = [
            ObjectFigure(scene, f"{name}/object{index}", object) for index, object in enumerate(track.objects)
        ]
        if track.stage is not None:
            add_plateau(scene, f"{name}/stage", track.stage)
        self._hands = [HandFigure(scene, f"{name}/{hand.side}", hand) for hand in track.hands]
        self._contacts = ContactFigure(scene, name, track.hands, track.objects, self._objects[0].parts)
        self._ghosts: list[MeshSkinnedHandle] = []
        self._target: TargetGhost | None = None
        self._appearance = Appearance()
        self._shown: Sample | None = None
        self.set_track(track)

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
        for ghost in self._ghosts:
            ghost.remove()
        self._ghosts = []
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
        if appearance.reference_ghost > 0 and not self._ghosts and self._aim is not None:
            self._ghosts = self._add_reference(self._aim)
        for ghost in self._ghosts:
            ghost.visible = appearance.reference_ghost > 0
            ghost.opacity = appearance.reference_ghost
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

    def remove(self) -> None:
        """Take it away."""
        self._root.remove()

    def _add_reference(self, aim: Aim) -> list[MeshSkinnedHandle]:
        """The hands of the reference, each below the part that it manipulates."""
        ghosts = []
        for hand in np.flatnonzero(aim.active).tolist():
            name = f"{self._objects[0].parts[aim.part[hand]]}/reference_{self._track.hands[hand].side}"
            ghosts.append(add_hand(self._scene, name, self._hands[hand].mesh("skin"), REFERENCE_GHOST, GHOST))
            pose_bones(ghosts[-1], aim.link_poses_in_part[hand])
        return ghosts
