"""How steady the physics is: objects at rest, hands that press, and grasps held in the air.

All references of a set are played at once, one world each, by plain PD control; nothing is learned or drawn.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.config import ActionConfig, PDGain, PDGains, PhysicsConfig, SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.kernels.actions import finger_synergy_basis
from artigrasp.kernels.layout import HANDS, WRIST_DOF_COUNT
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.world_block import CONTROL

Array = NDArray[np.float64]

PAPER_GAINS = PDGains()
"""The paper's: 50 N/m lets a hand sag by 2 cm per newton."""
CARRYING_GAINS = replace(PAPER_GAINS, wrist_translation=PDGain(kp=1000.0, kd=5.0))
"""Wrists that carry; the authors' motions raise the stiffness for it too."""

CONTROL_RATE = 100
"""Control steps per second."""
_SETTLE, _MEASURE = CONTROL_RATE // 2, 5 * CONTROL_RATE
_FAR = 5.0
"""Height of hands that are to touch nothing [m]."""
_HEIGHT = 0.5
"""Height at which objects are held [m]."""
_APPROACH, _CLOSE_START, _CLOSE_END, _RELEASE = 60, 30, 100, 130
"""Control steps of a grasp: at the reference, fingers begin to close, are closed, the object is let go."""
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
    """Of the hinge [rad]."""
    hinge_speed: Array
    """Largest speed of the hinge [rad/s]."""
    failed: NDArray[np.bool_]


def rest_drift(references: ReferenceSet, physics: PhysicsConfig = PhysicsConfig()) -> RestDrift:
    """Leave objects alone for 5.5 s, from the poses of references; the hands are far away."""
    worlds = _Worlds(references, physics, PAPER_GAINS, ("right",), fixed_base=False)
    worlds.lift(hand_height=_FAR)
    worlds.hold_hands()
    moved: dict[str, list[Array]] = {name: [] for name in ("distance", "turn", "hinge", "hinge_speed")}
    start = None
    for step in worlds.play(_SETTLE + _MEASURE):
        if step < _SETTLE:
            continue
        now = worlds.object_pose, worlds.hinge_angle
        start = start or now
        moved["distance"].append(np.linalg.norm(now[0][:, :3] - start[0][:, :3], axis=1))
        moved["turn"].append(_turn_between(start[0], now[0]))
        moved["hinge"].append(np.abs(now[1] - start[1]))
        moved["hinge_speed"].append(np.abs(worlds.hinge_speed))
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


def press_depth(references: ReferenceSet, physics: PhysicsConfig = PhysicsConfig(), squeeze: float = 0.3) -> PressDepth:
    """Let the hands of references close on fixed objects with the paper's gains and push toward their middle for 3 s.

    Args:
        references: What hands begin from.
        physics: Contact settings.
        squeeze: How far fingers are asked to flex beyond the reference [rad].
    """
    worlds = _Worlds(references, physics, PAPER_GAINS, HANDS, fixed_base=True)
    worlds.grasp(squeeze=squeeze, push=True)
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


def hold_slip(
    references: ReferenceSet,
    physics: PhysicsConfig = PhysicsConfig(),
    gains: PDGains = CARRYING_GAINS,
    squeeze: float = 0.3,
    settle: float = 2.0,
) -> HoldSlip:
    """Close hands on objects in the air, let go of the objects, and see how they slip.

    An object is kept where it is until the fingers have closed; then nothing but the hands carries it.

    Args:
        references: Grasps.
        physics: Contact settings.
        gains: Of the hands.
        squeeze: How far fingers are asked to flex beyond the reference [rad].
        settle: Time from the release until the 5 s begin [s].
    """
    worlds = _Worlds(references, physics, gains, HANDS, fixed_base=False)
    worlds.lift(hand_height=_HEIGHT, object_height=_HEIGHT)
    worlds.grasp(squeeze=squeeze)
    settled = _RELEASE + round(settle * CONTROL_RATE)
    moved = worlds.mark()
    before, slip, speeds = [], [], []
    for step in worlds.play(settled + _MEASURE, keep_until=_RELEASE):
        if step in (_RELEASE, settled):
            moved = worlds.mark()
        if step >= _RELEASE:
            (before if step < settled else slip).append(moved())
        if step >= settled + _MEASURE - CONTROL_RATE:
            speeds.append(worlds.hinge_speed)
    return HoldSlip(
        slip=np.max(slip, axis=0),
        before=np.max(before, axis=0),
        hinge_jitter=np.sqrt(np.mean(np.square(speeds), axis=0)),
        failed=worlds.failed,
    )


class _Worlds:
    """A world per reference under plain PD control toward targets that stay where they are in the world."""

    def __init__(
        self,
        references: ReferenceSet,
        physics: PhysicsConfig,
        gains: PDGains,
        hands: tuple[str, ...],
        fixed_base: bool,
    ) -> None:
        task = TaskConfig(
            name="steadiness",
            description="",
            hands=hands,  # type: ignore[arg-type]
            fixed_base=fixed_base,
            kinds=("articulate", "grasp"),
            physics=physics,
            gains=gains,
            action=ActionConfig(),
        )
        self._environment = environment = Environment(
            task, [references], trial_worlds([references], [-1.0]), noise=False, simulator=SimulatorConfig()
        )
        environment.reset()
        self._state, self._everyone = environment.state, wp.full(len(references), 1, dtype=int, device="cpu")
        self._kept = environment.state.objects.pose.numpy().copy(), environment.state.objects.hinge_q.numpy().copy()
        model = environment.simulation.models[0]  # type: ignore[attr-defined]
        names = [model.body(body).name for body in model.geom_bodyid]
        self._is_object = np.array([name.startswith("object") for name in names])
        self._mujoco = mujoco.MjData(model)
        self._basis = finger_synergy_basis(hands)[:, 0]
        self._targets: Callable[[int], Array] = lambda step: np.zeros(environment.target.shape)

    def lift(self, hand_height: float, object_height: float = 0.0) -> None:
        """Raise hands and objects from where they were reset [m]."""
        for array, height in ((self._state.hands.hand_base, hand_height), (self._state.objects.pose, object_height)):
            raised = array.numpy().copy()
            raised[..., 2] += height
            array.assign(raised)
        self._kept = self.object_pose.astype(np.float32), self._kept[1]
        self._environment.simulation.write_state(self._everyone)

    def hold_hands(self) -> None:
        """Let hands stay as they are."""
        start = self._state.hands.joint_q.numpy().copy()
        self._targets = lambda step: start

    def grasp(self, squeeze: float, push: bool = False) -> None:
        """Let active hands go to the reference and close on it; others stay.

        Args:
            squeeze: How far fingers are asked to flex beyond the reference [rad].
            push: Whether wrists then go on to the middle of the object.
        """
        goal, base = self._environment.goal, self._state.hands.hand_base.numpy()
        start = self._state.hands.joint_q.numpy().copy()
        active = goal.active.numpy()[..., None] != 0
        # the reset moved hands back without turning them, so that the reference is a translation of the base away
        wrist = self._reference_position() - base[..., :3]
        centre = self.object_pose[:, None, :3] - base[..., :3]
        to_base = Rotation.from_quat(base[..., 3:].reshape(-1, 4)).inv()
        wrist, centre = (to_base.apply(each.reshape(-1, 3)).reshape(each.shape) for each in (wrist, centre))
        closed = goal.finger_angles.numpy() + squeeze * self._basis
        opened = start[..., WRIST_DOF_COUNT:]

        def targets(step: int) -> Array:
            near = np.clip(step / _APPROACH, 0.0, 1.0)
            grip = np.clip((step - _CLOSE_START) / (_CLOSE_END - _CLOSE_START), 0.0, 1.0)
            result = start.astype(np.float64)
            place = near * wrist
            if push and step > _CLOSE_END:
                place = centre
            result[..., :3] = np.where(active, place, 0.0)
            result[..., WRIST_DOF_COUNT:] = np.where(active, (1 - grip) * opened + grip * closed, opened)
            return result

        self._targets = targets

    def play(self, step_count: int, keep_until: int = 0) -> Iterator[int]:
        """Simulate, and yield after every control step; objects stay where they are before ``keep_until``."""
        environment = self._environment
        for step in range(step_count):
            environment.target.assign(self._targets(step).astype(np.float32))
            environment.advance()
            if step < keep_until:
                self._keep_objects()
            yield step

    def _keep_objects(self) -> None:
        objects = self._state.objects
        objects.pose.assign(self._kept[0])
        objects.hinge_q.assign(self._kept[1])
        objects.velocity.zero_()
        objects.hinge_qd.zero_()
        self._environment.simulation.write_state(self._everyone)

    @property
    def object_pose(self) -> Array:
        """Frames of the bases, shape [world, 7]."""
        return self._state.objects.pose.numpy().astype(np.float64)

    @property
    def hinge_angle(self) -> Array:
        """Shape [world], rad."""
        return self._state.objects.hinge_q.numpy().astype(np.float64)

    @property
    def hinge_speed(self) -> Array:
        """Shape [world], rad/s."""
        return self._state.objects.hinge_qd.numpy().astype(np.float64)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether physics failed."""
        return np.asarray(self._environment.metrics.failure.numpy() != 0)

    def grip(self) -> Array:
        """Largest net contact force on a hand [N], shape [world]."""
        force = self._state.hands.contact_force.numpy().astype(np.float64).sum(axis=(2, 3))
        return np.asarray(np.linalg.norm(force, axis=-1).max(axis=1))

    def mark(self) -> Callable[[], Array]:
        """Remember the point of the object in the middle of each hand's keypoints.

        Returns:
            A function that tells how far these points have moved in the hands that take part [m], shape [world].
        """
        middle = self._state.hands.keypoint.numpy().astype(np.float64).mean(axis=2)
        in_wrist = self._in_wrist(middle)
        in_base = np.stack(
            [Rotation.from_quat(pose[3:]).inv().apply(rows - pose[:3]) for pose, rows in zip(self.object_pose, middle)]
        )
        active = self._environment.goal.active.numpy() != 0

        def moved() -> Array:
            points = np.stack(
                [Rotation.from_quat(pose[3:]).apply(rows) + pose[:3] for pose, rows in zip(self.object_pose, in_base)]
            )
            distance = np.linalg.norm(self._in_wrist(points) - in_wrist, axis=-1)
            return np.asarray(np.where(active, distance, 0.0).max(axis=1))

        return moved

    def _in_wrist(self, points: Array) -> Array:
        """World points, one for each hand, in the frames of the wrists."""
        wrist = self._state.hands.link_pose.numpy()[:, :, 0].astype(np.float64)
        turn = Rotation.from_quat(wrist[..., 3:].reshape(-1, 4)).inv()
        return np.asarray(turn.apply((points - wrist[..., :3]).reshape(-1, 3)).reshape(points.shape))

    def _reference_position(self) -> Array:
        """Wrist positions of the references in the world, shape [world, hand, 3]."""
        poses = self._environment.goal.link_pose_in_part.numpy()[:, :, 0].astype(np.float64)
        part = self._environment.goal.part.numpy()
        model = self._environment.objects[0]
        result = np.empty((*poses.shape[:2], 3))
        for world, (base, angle) in enumerate(zip(self.object_pose, self.hinge_angle)):
            for hand, pose in enumerate(poses[world]):
                position = pose[:3]
                if part[world, hand] == 1:
                    origin, turn = model.articulated_pose_in_base(float(angle))
                    position = origin + Rotation.from_quat(turn).apply(position)
                result[world, hand] = base[:3] + Rotation.from_quat(base[3:]).apply(position)
        return result

    def contact_depth(self) -> Array:
        """Depth of the deepest contact of a hand with the object in every world [m]."""
        simulation = self._environment.simulation
        assert isinstance(simulation, CpuSimulation)
        model, data = simulation.models[0], self._mujoco
        depth = np.zeros(simulation.world_count)
        for world, (state, control) in enumerate(
            zip(simulation.packed.state, simulation.packed.control, strict=True)
        ):
            mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
            mujoco.mj_setState(model, data, control, CONTROL)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            ours = [self._is_object[pair].sum() == 1 for pair in data.contact.geom]
            depth[world] = max((-distance for distance, our in zip(data.contact.dist, ours) if our), default=0.0)
        return np.maximum(depth, 0.0)


def _turn_between(first: Array, second: Array) -> Array:
    """Angle between the rotations of poses, shape [world]."""
    turn = Rotation.from_quat(first[:, 3:]).inv() * Rotation.from_quat(second[:, 3:])
    return np.asarray(turn.magnitude())
