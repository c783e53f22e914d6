"""How steady the physics is: objects at rest, hands that press, and grasps held in the air.

All references of a set are played at once, one world each, by plain PD control; nothing is learned or drawn.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.benchmark.reference_worlds import CONTROL_RATE, RELEASE_STEP, ReferenceWorlds
from artigrasp.config import PDGain, PDGains, PhysicsConfig
from artigrasp.kernels.layout import HANDS
from artigrasp.references.reference import ReferenceSet

PHYSICS = PhysicsConfig()
PAPER_GAINS = PDGains()
"""The paper's: 50 N/m lets a hand sag by 2 cm per newton."""
CARRYING_GAINS = replace(PAPER_GAINS, wrist_translation=PDGain(kp=1000.0, kd=5.0))
"""Wrists that carry; the authors' motions raise the stiffness for it too."""

_SETTLE, _MEASURE = CONTROL_RATE // 2, 5 * CONTROL_RATE
_HANG = 2 * CONTROL_RATE
"""Control steps from the release of a grasp until its slip is measured."""
_PRESSING = 0.3
"""How far the fingers of hands that press are asked to flex beyond the reference [rad]."""
_FAR = 5.0
"""Height of hands that are to touch nothing [m]."""
_HEIGHT = 0.5
"""Height at which objects are held [m]."""
_DROPPED = 0.1
"""Distance by which a dropped object moved in the hand at least [m]."""


@dataclass(frozen=True)
class RestDrift:
    """Largest motion of objects on the table from t = 0.5 s on, shape [reference]."""

    distance: Array
    """Of the base frame's origin [m]."""
    turn: Array
    """Of the base [rad]."""
    hinge: Array
    """Of the hinge [rad]. A light part on a viscous hinge sinks for many seconds."""
    hinge_unexplained: Array
    """What of it is more than gravity turns a hinge of its damping and friction by [rad]."""
    failed: NDArray[np.bool_]


def rest_drift(references: ReferenceSet, physics: PhysicsConfig = PHYSICS) -> RestDrift:
    """Leave objects alone for 5.5 s, from the poses of references; the hands are far away."""
    worlds = ReferenceWorlds(references, physics, PAPER_GAINS, ("right",), fixed_base=False)
    worlds.lift(hand_height=_FAR)
    worlds.hold_hands()
    moved: dict[str, list[Array]] = {name: [] for name in ("distance", "turn", "hinge", "hinge_unexplained")}
    start, sunk = None, np.zeros(len(references))
    for step in worlds.play(_SETTLE + _MEASURE):
        if step < _SETTLE:
            continue
        now = worlds.object_pose, worlds.hinge_angle
        start = start or now
        moved["distance"].append(np.linalg.norm(now[0][:, :3] - start[0][:, :3], axis=1))
        moved["turn"].append(_turn_between(start[0], now[0]))
        moved["hinge"].append(np.abs(now[1] - start[1]))
        moved["hinge_unexplained"].append(np.maximum(moved["hinge"][-1] - sunk, 0.0))
        sunk += worlds.sinking_speed() / CONTROL_RATE
    return RestDrift(**{name: np.max(rows, axis=0) for name, rows in moved.items()}, failed=worlds.failed)


@dataclass(frozen=True)
class PressDepth:
    """How deep hands sink into objects, from the distances of MuJoCo's contacts, shape [reference]."""

    peak: Array
    """At any control step [m]."""
    steady: Array
    """In the mean of the last half second, deepest contact of each step [m]."""
    force: Array
    """Largest net force on a hand in the last half second [N]."""
    began_inside: NDArray[np.bool_]
    """Whether a hand was in the object before it had moved: such a start is the reference's, and no press."""
    failed: NDArray[np.bool_]


def press_depth(references: ReferenceSet, physics: PhysicsConfig = PHYSICS) -> PressDepth:
    """Let the hands of references close on fixed objects with the paper's gains and push toward their middle for 3 s.

    Args:
        references: What hands begin from.
        physics: Contact settings.
    """
    worlds = ReferenceWorlds(references, physics, PAPER_GAINS, HANDS, fixed_base=True)
    worlds.grasp(squeeze=_PRESSING, push=True)
    began_inside = worlds.contact_depth() > 0.0
    depth, force = [], []
    for _ in worlds.play(3 * CONTROL_RATE):
        depth.append(worlds.contact_depth())
        force.append(worlds.grip())
    last = slice(-CONTROL_RATE // 2, None)
    return PressDepth(
        peak=np.max(depth, axis=0),
        steady=np.mean(depth[last], axis=0),
        force=np.max(force[last], axis=0),
        began_inside=began_inside,
        failed=worlds.failed,
    )


@dataclass(frozen=True)
class HoldSlip:
    """How far objects move in the hands that hold them in the air, shape [reference]."""

    slip: Array
    """Within 5 s, of the point of the object that was in the middle of the hand, seen from the wrist; the larger of two
    hands [m]."""
    before: Array
    """The same from the release to the beginning of those 5 s, while hands sag and grasps settle [m]."""
    hinge_jitter: Array
    """Root mean square of the hinge's speed in the last second [rad/s]."""
    failed: NDArray[np.bool_]

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether the object stayed in the hands: those that were dropped moved by more than 10 cm."""
        return np.asarray((self.slip < _DROPPED) & (self.before < _DROPPED) & ~self.failed)


def hold_slip(references: ReferenceSet, physics: PhysicsConfig = PHYSICS, squeeze: float = 0.0) -> HoldSlip:
    """Close hands on objects in the air, let go of the objects, and see how they slip.

    An object is kept where it is until the fingers have closed; then nothing but the hands carries it.

    Args:
        references: Grasps.
        physics: Contact settings.
        squeeze: How far fingers are asked to flex beyond the reference [rad].
    """
    worlds = ReferenceWorlds(references, physics, CARRYING_GAINS, HANDS, fixed_base=False)
    worlds.lift(hand_height=_HEIGHT, object_height=_HEIGHT)
    worlds.grasp(squeeze=squeeze)
    settled = RELEASE_STEP + _HANG
    moved = worlds.mark()
    before: list[Array] = []
    slip: list[Array] = []
    speeds: list[Array] = []
    for step in worlds.play(settled + _MEASURE, keep_until=RELEASE_STEP):
        if step in (RELEASE_STEP, settled):
            moved = worlds.mark()
        if step >= RELEASE_STEP:
            (before if step < settled else slip).append(moved())
        if step >= settled + _MEASURE - CONTROL_RATE:
            speeds.append(worlds.hinge_speed)
    return HoldSlip(
        slip=np.max(slip, axis=0),
        before=np.max(before, axis=0),
        hinge_jitter=np.sqrt(np.mean(np.square(speeds), axis=0)),
        failed=worlds.failed,
    )


def _turn_between(first: Array, second: Array) -> Array:
    """Angle between the rotations of poses, shape [world]."""
    turn = Rotation.from_quat(first[:, 3:]).inv() * Rotation.from_quat(second[:, 3:])
    return np.asarray(turn.magnitude())
