"""A target that can be moved over the table: a ghost of the object with handles."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation
from viser import SceneApi, TransformControlsEvent, TransformControlsHandle

from artigrasp.assets.object import load_object
from artigrasp.references.reference import load_references
from artigrasp.viewer.appearance import WISH_GHOST
from artigrasp.viewer.conventions import to_wxyz, to_xyzw
from artigrasp.viewer.object_figure import TargetGhost
from artigrasp.viewer.wish import SPLIT, Wish

OnMove = Callable[[tuple[float, float], float], None]
NODE = "/target_handle"
SCALE = 0.16
"""Of the handles [m]."""


class TargetGizmo:
    """The object of a wish at its target, with handles to move it along the table and to turn it about the vertical."""

    def __init__(self, scene: SceneApi, on_move: OnMove) -> None:
        """Show nothing yet; call ``on_move`` with shift [m] and yaw [rad] whenever somebody moves it."""
        self._scene, self._on_move = scene, on_move
        self._handle: TransformControlsHandle | None = None
        self._shown: tuple[str, float] | None = None

    def show(self, wish: Wish | None) -> None:
        """Show the target of a wish, None to hide it."""
        if wish is None:
            if self._handle is not None:
                self._handle.remove()
            self._handle = self._shown = None
            return
        if self._shown == (wish.object, wish.angle):
            return
        if self._handle is not None:
            self._handle.remove()
        self._shown = wish.object, wish.angle
        start = load_references(wish.object).select(split=SPLIT, kind="grasp", indices=wish.grasp).object_pose[0]
        turn = Rotation.from_euler("z", wish.yaw) * Rotation.from_quat(start[3:])
        position = start[:3] + np.array([*wish.shift, 0.0])
        handle = self._handle = self._scene.add_transform_controls(
            NODE,
            scale=SCALE,
            active_axes=(True, True, False),
            depth_test=False,
            position=position,
            wxyz=to_wxyz(turn.as_quat()),
        )
        object = load_object(wish.object)
        TargetGhost(self._scene, f"{NODE}/object", object, wish.angle, with_base=True, colour=WISH_GHOST)

        def move(event: TransformControlsEvent) -> None:
            shift = handle.position - start[:3]
            yaw = (Rotation.from_quat(to_xyzw(handle.wxyz)) * Rotation.from_quat(start[3:]).inv()).as_rotvec()[2]
            self._on_move((float(shift[0]), float(shift[1])), float(yaw))

        handle.on_update(move)
