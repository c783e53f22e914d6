"""Generation: a controller plays one reference toward a target angle, and the motion is recorded."""

import importlib.metadata
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.config import ActionConfig, PhaseConfig, SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.rollout import OnPlan, run_episode
from artigrasp.controllers.skills import in_free_scene, with_skills
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import planned_worlds
from artigrasp.kernels.phases import OUTCOMES
from artigrasp.motion.motion import Motion, MotionBystanders, MotionReference
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.backend import PACKAGES


def generate(
    controller: Controller,
    references: ReferenceSet,
    target_angle: float,
    *,
    sequence: Sequence[PhaseConfig] | None = None,
    target_offset: ArrayLike | None = None,
    retry_count: int = 0,
    seed: int = 0,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_step: Callable[[int], None] = lambda step: None,
    on_plan: OnPlan = lambda done, total: None,
) -> Motion:
    """Simulate one episode and record it.

    Args:
        controller: What acts.
        references: The reference to play, or for a sequence its first and its second, see
            :meth:`ReferenceSet.select` and :func:`join_references`.
        target_angle: Hinge angle to reach [rad].
        sequence: Phases of PD+IK, in which the controller acts where it has the skill; without them it plays the one
            reference.
        target_offset: For a sequence, from the start to the target of the object's base along the world's axes: shift
            [m] and quaternion xyzw, shape [7]; by default it should end where it starts.
        retry_count: How often a failed phase may be tried again.
        seed: Seed of the environment; hands start without noise.
        simulator: Backend, device and threads.
        on_step: Called with the control steps done, for progress.
        on_plan: Called while a search plans.

    Returns:
        One sample per control step and one for the start.

    Raises:
        ValueError: There are more or fewer references than are played.
        UserError: An asset, backend or device is missing.
    """
    if len(references) != (1 if sequence is None else 2):
        expected = "exactly one" if sequence is None else "two"
        raise ValueError(f"references: expected {expected}, found {len(references)}")
    worlds = planned_worlds(
        [references],
        [0],
        [0],
        target_angle,
        second_reference=[len(references) - 1],
        target_offset=None if target_offset is None else np.reshape(target_offset, (1, 7)),
    )
    if sequence is not None:
        controller = in_free_scene(controller)
    environment = Environment(
        controller.task,
        [references],
        worlds,
        sequence=None if sequence is None else with_skills(sequence, controller),
        retry_count=retry_count,
        seed=seed,
        noise=False,
        simulator=simulator,
    )
    recorder = MotionRecorder(environment, world=0)

    def record(step: int) -> None:
        recorder.record(step)
        on_step(step)

    run_episode(environment, controller, record, on_plan)
    return recorder.motion(controller, seed)


class MotionRecorder:
    """Keeps the states of one world as they pass."""

    def __init__(self, environment: Environment, world: int) -> None:
        """Record ``world`` of ``environment``."""
        self._environment, self._world = environment, world
        self._steps: list[int] = []
        self._samples: dict[str, list[NDArray[Any]]] = {
            name: [] for name in ("joint_q", "hand_base", "slot_pose", "slot_angle", "contact_force", "focus")
        }
        self._phases: list[str] = []

    def record(self, step: int) -> None:
        """Take the present state as the sample of this control step."""
        state = self._environment.state
        hands, slots = state.hands, state.slots
        arrays = {
            "joint_q": hands.joint_q,
            "hand_base": hands.hand_base,
            "slot_pose": slots.pose,
            "slot_angle": slots.hinge_q,
            "contact_force": hands.contact_force,
            "focus": state.focus,
        }
        self._steps.append(step)
        self._phases.append(self._phase_name(step))
        for name, array in arrays.items():
            self._samples[name].append(self._read(array))

    def motion(self, controller: Controller, seed: int) -> Motion:
        """The recorded motion with its reference, metrics and provenance."""
        environment, world, task = self._environment, self._world, self._environment.task
        reference = environment.references[environment.worlds.object_index[world]]
        goal, summary = environment.goal, environment.episode_summary()
        samples = {name: np.stack(values) for name, values in self._samples.items()}
        hand_bases = samples.pop("hand_base")
        poses, angles, focus = (samples.pop(name) for name in ("slot_pose", "slot_angle", "focus"))
        return Motion(
            time=np.array(self._steps) * task.control_dt,
            hands=task.hands,
            hand=environment.hand_name,
            object=reference.object,
            hand_base=hand_bases[0],
            joint_q=relative_to_first_base(samples["joint_q"], hand_bases),
            object_pose=poses[:, 0],
            hinge_angle=angles[:, 0],
            contact_force=samples["contact_force"],
            phases=np.array(self._phases),
            target_angle=float(self._read(goal.target_angle)),
            target_object_pose=self._read(goal.target_object_pose),
            bystanders=self._bystanders(poses, angles, focus),
            stage=task.stage,
            reference=MotionReference(
                part=self._read(goal.part),
                wrist_pose_in_part=self._read(goal.wrist_pose_in_part),
                finger_angles=self._read(goal.finger_angles),
            ),
            metrics={name: float(values[world]) for name, values in summary.items()},
            provenance={
                "task": task.name,
                "controller": controller.name,
                "rollouts": str(controller.rollout_count),
                "reference": str(reference.source[environment.reference_rows()[world]]),
                **self._sequence_provenance(reference),
                "seed": str(seed),
                **{name: importlib.metadata.version(name) for name in ("artigrasp", *PACKAGES)},
            },
        )

    def _bystanders(
        self, poses: NDArray[np.float32], angles: NDArray[np.float32], focus: NDArray[np.int64]
    ) -> MotionBystanders | None:
        names = tuple(each.object for each in self._environment.bystanders)
        return MotionBystanders(names, poses[:, 1:], angles[:, 1:], focus) if names else None

    def _read(self, array: wp.array) -> NDArray[Any]:
        # a copy: on the CPU the rows would go on changing with the environment's
        return np.array(array.numpy()[self._world])

    def _sequence_provenance(self, reference: ReferenceSet) -> dict[str, str]:
        """What became of the phases, and what the first of two references was."""
        environment = self._environment
        if len(environment.phases) == 1:
            return {}
        outcomes = self._read(environment.phase_outcome)
        named = zip(environment.phases, outcomes, strict=True)
        first = environment.rows_in_sets(environment.worlds.first_reference)[self._world]
        return {
            "first reference": str(reference.source[first]),
            "phases": "\n".join(f"{phase.name}: {OUTCOMES[code]}" for phase, code in named),
            "retries": str(self._read(environment.phase.retry_count)),
        }

    def _phase_name(self, step: int) -> str:
        if len(self._environment.phases) == 1:
            return phase_name(self._environment.task.action, step)
        return self._environment.phases[int(self._read(self._environment.phase.index))].name


def relative_to_first_base(joint_q: NDArray[np.float32], hand_bases: NDArray[np.float32]) -> NDArray[np.float32]:
    """Joint coordinates whose wrist is relative to one base frame, though each phase had its own.

    Args:
        joint_q: Joint coordinates [m | rad], shape ``[T, H, 51]``.
        hand_bases: Base frame of every sample: position [m], quaternion xyzw, shape ``[T, H, 7]``.

    Returns:
        The same, relative to the first base frame; wrist angles go on without jumps.
    """
    if (hand_bases == hand_bases[0]).all():
        return joint_q
    result = joint_q.copy()
    for hand in range(joint_q.shape[1]):
        first = Rotation.from_quat(hand_bases[0, hand, 3:])
        base = Rotation.from_quat(hand_bases[:, hand, 3:])
        position = hand_bases[:, hand, :3] + base.apply(joint_q[:, hand, :3])
        result[:, hand, :3] = first.inv().apply(position - hand_bases[0, hand, :3])
        turn = first.inv() * base * Rotation.from_euler("XYZ", joint_q[:, hand, 3:6])
        result[:, hand, 3:6] = _continuous(turn.as_euler("XYZ"))
    return result


def _continuous(angles: Array) -> Array:
    """Intrinsic XYZ angles [T, 3], each triple replaced by the equivalent one that is nearest to the one before."""
    result = angles.copy()
    for now in range(1, len(angles)):
        x, y, z = angles[now]
        triples = np.array([[x, y, z], [x + np.pi, np.pi - y, z + np.pi]])
        triples += 2 * np.pi * np.round((result[now - 1] - triples) / (2 * np.pi))
        result[now] = min(triples, key=lambda triple: float(np.abs(triple - result[now - 1]).sum()))
    return result


def phase_name(action: ActionConfig, step: int) -> str:
    """What a hand is doing at a control step: approach, grasp or articulate."""
    if action.finger_prior == "current" or step >= action.lead_start:
        return "articulate"
    return "approach" if step < action.close_start else "grasp"
