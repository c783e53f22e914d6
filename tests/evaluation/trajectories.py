"""Episodes whose states are written by hand, measured by the code that measures simulated ones."""

from dataclasses import replace

import numpy as np
import warp as wp
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.evaluation.quality import QualityRecorder
from artigrasp.kernels.layout import ARTICULATED, LINK_COUNT
from artigrasp.simulation.launches import OnWorlds
from artigrasp.tasks import get_task
from tests.example_references import box_references

STEP_COUNT = 40


class Trajectory:
    """States after each control step: nothing moves or touches, and the object is closed, unless told otherwise."""

    def __init__(
        self,
        *,
        angle: ArrayLike = 0.0,
        position: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike = (0.0, 0.0, 0.0),
        start_angle: float = 0.0,
        wrist: ArrayLike = (0.0, 0.0, 0.0),
        force: ArrayLike = 0.0,
    ) -> None:
        """Write an episode, step by step or with one value for all steps.

        Args:
            angle: Hinge angle [rad], shape [step].
            position: Displacement of the base [m], shape [step, 3].
            rotation: Rotation vector by which it has turned [rad], shape [step, 3].
            start_angle: Hinge angle before the first step [rad].
            wrist: Displacement of the wrist [m], shape [step, 3].
            force: Force of the articulated part on each link along z [N], shape [step, 16].
        """
        self.start_angle = start_angle
        self.angle = np.broadcast_to(np.asarray(angle, float), STEP_COUNT)
        self.wrist = np.broadcast_to(np.asarray(wrist, float), (STEP_COUNT, 3))
        self.force = np.broadcast_to(np.asarray(force, float), (STEP_COUNT, LINK_COUNT))
        self.position = np.broadcast_to(np.asarray(position, float), (STEP_COUNT, 3))
        self.rotation = Rotation.from_rotvec(np.broadcast_to(np.asarray(rotation, float), (STEP_COUNT, 3)).copy())


def through(*values: ArrayLike) -> Array:
    """Straight lines through values, the last of which is reached at the last step and held for a while."""
    points = np.array(values, dtype=float)
    times = np.linspace(0.0, 0.8 * STEP_COUNT, len(points))
    steps = np.arange(1, STEP_COUNT + 1)
    columns = points.reshape(len(points), -1).T
    return np.stack([np.interp(steps, times, column) for column in columns], axis=-1).reshape(-1, *points.shape[1:])


def play(
    trajectories: list[Trajectory], goal_angle: float, flip_quaternions: bool = False
) -> tuple[Environment, QualityRecorder]:
    """Make every trajectory one world's episode.

    Args:
        trajectories: What happens.
        goal_angle: Target of all of them [rad].
        flip_quaternions: Whether every second state has the quaternion of the other sign, which means the same.

    Returns:
        The environment and what has recorded it.
    """
    references = box_references().select(indices=np.zeros(len(trajectories), int))
    references = replace(references, object_angle=np.array([each.start_angle for each in trajectories]))
    task = replace(get_task("right-fixed"), episode_steps=STEP_COUNT)
    environment = Environment(task, [references], trial_worlds([references], [goal_angle]), noise=False)
    quality = QualityRecorder(environment)
    environment.reset()
    quality.record(0)
    hands, objects = environment.state.hands, environment.state.objects
    start_wrist = hands.joint_q.numpy()[:, 0, :3].copy()
    start = objects.pose.numpy().copy()

    def write_state(apply_torques: OnWorlds, begin: OnWorlds, finish: OnWorlds) -> None:
        for rows in environment.simulation.torque_rows:
            begin(rows)
        step = int(environment.step_count.numpy()[0])
        pose = start.copy()
        pose[:, :3] += [each.position[step] for each in trajectories]
        turns = Rotation.concatenate([each.rotation[step] for each in trajectories])
        pose[:, 3:] = (turns * Rotation.from_quat(start[:, 3:])).as_quat()
        if flip_quaternions and step % 2:
            pose[:, 3:] *= -1.0
        objects.pose.assign(pose)
        joint_q, contact_force = hands.joint_q.numpy(), hands.contact_force.numpy()
        joint_q[:, 0, :3] = start_wrist + [each.wrist[step] for each in trajectories]
        contact_force[:, 0, :, ARTICULATED, 2] = [each.force[step] for each in trajectories]
        hands.joint_q.assign(joint_q)
        hands.contact_force.assign(contact_force)
        objects.hinge_q.assign(np.array([each.angle[step] for each in trajectories], dtype=np.float32))
        for rows in environment.simulation.torque_rows:
            finish(rows)

    environment.simulation.step = write_state  # type: ignore[method-assign]
    action = wp.zeros((len(trajectories), 1, environment.action_count), dtype=float)
    for step in range(STEP_COUNT):
        environment.step(action)
        quality.record(step + 1)
    return environment, quality
