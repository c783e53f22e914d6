"""Fit a right hand to an object: from a rough intent to a pose that touches without going inside.

A pose of the fingers is a sum of a few motions, so that it stays one that a human hand can do. The fit is a nonlinear
least-squares problem: fingertips near their targets, pads facing the right way, nothing inside the object or the table,
close to the relaxed pose of the intent.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import Box, HandModel
from artigrasp.assets.hand_table import hand_table, put_hands
from artigrasp.kernels import kinematics, states
from artigrasp.kernels.layout import DOFS, LINK_COUNT, LONG_FINGERS, TIP_LINKS, WRIST_DOF_COUNT
from artigrasp.references.synthesis.fingertips import PADS

LAST_JOINT_SHARE = 0.6
"""The last joint of a finger follows the one before it by this share."""
MOTIONS: dict[str, dict[str, float]] = {
    **{f"{finger}_knuckle": {f"{finger}1_rz": 1.0} for finger in LONG_FINGERS},
    **{f"{finger}_spread": {f"{finger}1_ry": 1.0} for finger in LONG_FINGERS},
    **{f"{finger}_curl": {f"{finger}2_rz": 1.0, f"{finger}3_rz": LAST_JOINT_SHARE} for finger in LONG_FINGERS},
    **{f"thumb1_{axis}": {f"thumb1_r{axis}": 1.0} for axis in "xyz"},
    **{f"{joint}_curl": {f"{joint}_ry": -np.sqrt(0.5), f"{joint}_rz": np.sqrt(0.5)} for joint in ("thumb2", "thumb3")},
}
"""The motions that make up a pose of the fingers, and the joint angles that each of them turns [rad per rad]."""
BASIS = np.array([[turned.get(dof, 0.0) for dof in DOFS[WRIST_DOF_COUNT:]] for turned in MOTIONS.values()])
MOTION_FREEDOM = np.array([0.1 if "spread" in name else 0.35 for name in MOTIONS])
WRIST_FREEDOM = 0.12
"""How far a fit may leave the relaxed pose and the intended rotation of the wrist, one standard deviation [rad]."""
TABLE_CLEARANCE = 0.012
"""Least height of the skin above the table [m]."""


@dataclass(frozen=True, eq=False)
class Intent:
    """What a hand wants to do, in the world.

    Attributes:
        name: Of the kind of grip.
        wrist: Rotation of the wrist.
        motions: Relaxed fingers, order ``MOTIONS`` [rad], shape (17,).
        tips: Where the middle of each fingertip should be, order ``TIP_FINGERS`` [m], shape (5, 3).
        axes: Rows in which ``freedom`` is given, shape (3, 3).
        freedom: How far they may be from there, one standard deviation [m], shape (5, 3); infinite for idle ones.
        pads: The way each pad should face, shape (5, 3).
    """

    name: str
    wrist: Rotation
    motions: Array
    tips: Array
    axes: Array
    freedom: Array
    pads: Array

    @property
    def busy(self) -> NDArray[np.bool_]:
        """The fingertips that have something to do, shape (5,)."""
        return np.asarray(np.isfinite(self.freedom).all(axis=1))


@dataclass(frozen=True, eq=False)
class Pose:
    """A fitted hand in the world.

    Attributes:
        wrist: Position [m] and quaternion xyzw, shape (7,).
        finger_angles: Order ``DOFS`` [rad], shape (45,).
        gaps: Between the skin of each link and each solid [m], negative inside, shape (16, S).
        height: Least height of the skin above the table [m].
    """

    wrist: Array
    finger_angles: Array
    gaps: Array
    height: float


class HandFitter:
    """Fits a hand to intents on solids, each the axis-aligned box between two corners."""

    def __init__(self, hand: HandModel, solids: list[Array]) -> None:
        """Sample the hand's colliders: points inside it with their distance from the skin."""
        points, links, radii = [], [], []
        for link, colliders in enumerate(hand.colliders):
            for shape in colliders:
                if isinstance(shape, Box):
                    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, count) for count in (6, 2, 6)]), -1)
                    local, radius = grid.reshape(-1, 3) * shape.extents, 0.0
                else:
                    local, radius = np.outer(np.linspace(-0.5, 0.5, 5), [0.0, 0.0, shape.length]), shape.radius
                points.append(Rotation.from_quat(shape.orientation).apply(local) + shape.position)
                links += [link] * len(local)
                radii += [radius] * len(local)
        self._points, self._links, self._radii = np.concatenate(points), np.array(links), np.array(radii)
        self.tip_radii = np.array([self._radii[self._links == link][0] for link in TIP_LINKS])
        reach = np.linalg.norm(hand.tip_offset, axis=1)
        self._tips = hand.tip_offset * ((reach - self.tip_radii) / reach)[:, None]
        self._bounds = np.array([_range(motion, hand) for motion in BASIS]).T
        self._solids = solids
        self._model = hand_table([hand], "cpu")

    def fit(self, intent: Intent) -> Pose:
        """The pose that serves the intent best."""
        start = np.concatenate([np.zeros(6), np.clip(intent.motions, *self._bounds)])
        start[:3] = (intent.tips - self._place(start[None], intent)[0][0])[intent.busy].mean(axis=0)
        free = np.full((2, 6), [[-np.inf], [np.inf]])
        step = 1e-4
        ahead = np.concatenate([np.zeros((1, len(start))), step * np.eye(len(start))])

        def residuals(x: Array) -> Array:
            return np.asarray(self._residuals(x[None], intent)[0])

        def jacobian(x: Array) -> Array:
            here, *moved = self._residuals(x + ahead, intent)
            return np.asarray((np.stack(moved) - here).T / step)

        bounds = tuple(np.concatenate([free, self._bounds], axis=1))
        x = least_squares(residuals, start, jacobian, bounds, ftol=1e-4, max_nfev=50).x
        wrist, finger_angles = _unpack(x[None], intent)
        _, _, points = self._place(x[None], intent)
        gaps = np.stack([box_distance(points[0], solid) - self._radii for solid in self._solids], axis=1)
        return Pose(
            wrist=wrist[0],
            finger_angles=finger_angles[0],
            gaps=np.stack([gaps[self._links == link].min(axis=0) for link in range(LINK_COUNT)]),
            height=float((points[0, :, 2] - self._radii).min()),
        )

    def _residuals(self, x: Array, intent: Intent) -> Array:
        """What a fit makes small, in standard deviations, shape [N, M]."""
        tips, pads, points = self._place(x, intent)
        knuckles = x[:, 6 : 6 + len(LONG_FINGERS)]
        terms = [
            (tips - intent.tips) @ intent.axes.T / intent.freedom,
            np.minimum(np.sum(pads * intent.pads, axis=-1) - 0.5, 0.0) * intent.busy / 0.3,
            *(np.minimum(box_distance(points, solid) - self._radii + 0.001, 0.0) / 0.001 for solid in self._solids),
            np.minimum(points[..., 2] - self._radii - TABLE_CLEARANCE, 0.0) / 0.002,
            x[:, 3:6] / WRIST_FREEDOM,
            (x[:, 6:] - intent.motions) / MOTION_FREEDOM,
            np.diff(knuckles, axis=1) / 0.3,
        ]
        return np.concatenate([term.reshape(len(x), -1) for term in terms], axis=1)

    def _place(self, x: Array, intent: Intent) -> tuple[Array, Array, Array]:
        """Middles and pad directions of the fingertips [N, 5, 3], and all points of the hand [N, P, 3]."""
        wrist, finger_angles = _unpack(x, intent)
        state = states.hand_state(len(x), 1, "cpu")
        put_hands(state, wrist[:, None], finger_angles[:, None])
        wp.launch(kinematics.forward_kinematics, dim=(len(x), 1), inputs=[state, self._model], device="cpu")
        frames = state.link_pose.numpy()[:, 0].astype(np.float64)
        turns = Rotation.from_quat(frames[..., 3:].reshape(-1, 4)).as_matrix().reshape(-1, LINK_COUNT, 3, 3)

        def place(local: Array, links: NDArray[np.int64]) -> Array:
            return np.asarray(np.einsum("npij,pj->npi", turns[:, links], local) + frames[:, links, :3])

        tips = np.array(TIP_LINKS)
        return (
            place(self._tips, tips),
            np.einsum("npij,pj->npi", turns[:, tips], PADS),
            place(self._points, self._links),
        )


def box_distance(points: Array, corners: Array) -> Array:
    """Signed distance of points [..., 3] from an axis-aligned box given by two corners [2, 3], negative inside [m]."""
    beyond = np.maximum(corners[0] - points, points - corners[1])
    distance: Array = np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0)
    return distance


def _unpack(x: Array, intent: Intent) -> tuple[Array, Array]:
    """Wrist poses [N, 7] and finger angles [N, 45] of what a fit varies."""
    rotation = Rotation.from_rotvec(x[:, 3:6]) * intent.wrist
    return np.concatenate([x[:, :3], rotation.as_quat()], axis=1), x[:, 6:] @ BASIS


def _range(motion: Array, hand: HandModel) -> tuple[float, float]:
    """How far a motion can go until the first joint is at its limit."""
    used = motion != 0
    limits = np.stack([hand.lower, hand.upper], axis=1)[WRIST_DOF_COUNT:][used] / motion[used, None]
    return limits.min(axis=1).max(), limits.max(axis=1).min()
