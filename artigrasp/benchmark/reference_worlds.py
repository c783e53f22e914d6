"""Worlds that play references by plain PD control, for measuring the physics and nothing else."""

from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.config import PDGains, PhysicsConfig, SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.kernels.layout import ARTICULATED, WRIST_DOF_COUNT
from artigrasp.kernels.synergies import finger_synergy_basis
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.world_block import CONTROL

CONTROL_RATE = 100
"""Control steps per second."""
APPROACH_STEPS, CLOSE_START, CLOSE_END, RELEASE_STEP = 60, 30, 100, 130
"""Control steps of a grasp: at the reference, fingers begin to close, are closed, the object is let go."""
_GRAVITY = 9.81


class ReferenceWorlds:
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
            push: Whether wrists are then, within a second, asked to go on to the middle of the object.
        """
        goal, base = self._environment.goal, self._state.hands.hand_base.numpy()
        start = self._state.hands.joint_q.numpy().copy()
        active = goal.active.numpy()[..., None] != 0
        # the reset moved hands back without turning them, so that the reference is a translation of the base away
        wrist = self._reference_position() - base[..., :3]
        centre = self.object_pose[:, None, :3] - base[..., :3]
        to_base = Rotation.from_quat(base[..., 3:].reshape(-1, 4)).inv()
        wrist, centre = (to_base.apply(each.reshape(-1, 3)).reshape(wrist.shape) for each in (wrist, centre))
        closed = goal.finger_angles.numpy() + squeeze * self._basis
        opened = start[..., WRIST_DOF_COUNT:]

        def targets(step: int) -> Array:
            near = np.clip(step / APPROACH_STEPS, 0.0, 1.0)
            grip = np.clip((step - CLOSE_START) / (CLOSE_END - CLOSE_START), 0.0, 1.0)
            result: Array = start.astype(np.float64)
            place = near * wrist
            if push:
                place = place + np.clip((step - CLOSE_END) / CONTROL_RATE, 0.0, 1.0) * (centre - wrist)
            result[..., :3] = np.where(active, place, 0.0)
            result[..., WRIST_DOF_COUNT:] = np.where(active, (1 - grip) * opened + grip * closed, opened)
            return np.asarray(result)

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
        return np.array(self._state.objects.pose.numpy(), dtype=np.float64)

    @property
    def hinge_angle(self) -> Array:
        """Shape [world], rad."""
        return np.array(self._state.objects.hinge_q.numpy(), dtype=np.float64)

    @property
    def hinge_speed(self) -> Array:
        """Shape [world], rad/s."""
        return np.array(self._state.objects.hinge_qd.numpy(), dtype=np.float64)

    def sinking_speed(self) -> Array:
        """At which gravity turns the hinge against its damping and friction [rad/s], shape [world]."""
        model = self._environment.objects[0]
        if model.hinge_damping == 0.0:
            return np.zeros(len(self.object_pose))
        base, angle = self.object_pose, self.hinge_angle
        turn = Rotation.from_rotvec(angle[:, None] * model.hinge_axis)
        turned = Rotation.from_quat(base[:, 3:])
        part = model.parts[ARTICULATED]
        arm = turned.apply(turn.apply(part.com - model.hinge_origin))
        torque = np.sum(turned.apply(model.hinge_axis) * np.cross(arm, [0.0, 0.0, -_GRAVITY * part.mass]), axis=1)
        return np.asarray(np.maximum(np.abs(torque) - model.hinge_friction, 0.0) / model.hinge_damping)

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
        in_base = self._in_base(middle)
        active = self._environment.goal.active.numpy() != 0

        def moved() -> Array:
            points = self._in_world(in_base)
            distance = np.linalg.norm(self._in_wrist(points) - in_wrist, axis=-1)
            return np.asarray(np.where(active, distance, 0.0).max(axis=1))

        return moved

    def _in_wrist(self, points: Array) -> Array:
        """World points, one for each hand, in the frames of the wrists."""
        return _transformed(self._state.hands.link_pose.numpy()[:, :, 0], points, inverse=True)

    def _reference_position(self) -> Array:
        """Wrist positions of the references in the world, shape [world, hand, 3]."""
        goal, model = self._environment.goal, self._environment.objects[0]
        in_part = goal.link_pose_in_part.numpy()[:, :, 0, :3].astype(np.float64)
        opened = Rotation.from_rotvec(self.hinge_angle[:, None] * model.hinge_axis)
        in_base = np.stack(
            [opened.apply(rows - model.hinge_origin) + model.hinge_origin for rows in in_part.swapaxes(0, 1)], axis=1
        )
        turns = goal.part.numpy()[..., None] == ARTICULATED
        return self._in_world(np.where(turns, in_base, in_part))

    def _in_base(self, points: Array) -> Array:
        """World points, one for each hand, in the frames of the objects' bases."""
        return _transformed(np.repeat(self.object_pose[:, None], points.shape[1], axis=1), points, inverse=True)

    def _in_world(self, points: Array) -> Array:
        """Points in the frames of the objects' bases, one for each hand, in the world."""
        return _transformed(np.repeat(self.object_pose[:, None], points.shape[1], axis=1), points)

    def contact_depth(self) -> Array:
        """Depth of the deepest contact of a hand with the object in every world [m]."""
        simulation = self._environment.simulation
        assert isinstance(simulation, CpuSimulation)
        model, data = simulation.models[0], self._mujoco
        depth = np.zeros(simulation.world_count)
        for world in range(simulation.world_count):
            mujoco.mj_setState(model, data, simulation.packed.state[world], mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
            mujoco.mj_setState(model, data, simulation.packed.control[world], CONTROL)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            # a hand and the object: of a fixed base the object touches nothing else, and hands touch each other
            ours = self._is_object[data.contact.geom].sum(axis=1) == 1
            depth[world] = -data.contact.dist[ours].min(initial=0.0)
        return depth


def _transformed(poses: NDArray[Any], points: Array, inverse: bool = False) -> Array:
    """Points, one for each pose [..., 7], taken out of the frames of the poses, or into them."""
    turn = Rotation.from_quat(poses[..., 3:].reshape(-1, 4).astype(np.float64))
    origin = poses[..., :3].reshape(-1, 3).astype(np.float64)
    rows = points.reshape(-1, 3)
    return np.asarray(turn.inv().apply(rows - origin) if inverse else turn.apply(rows) + origin).reshape(points.shape)
