"""Random states for the kernel tests, as NumPy arrays and on the device."""

from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.kernels import states
from artigrasp.kernels.layout import DOF_COUNT, FINGER_DOF_COUNT, KEYPOINT_COUNT, LINK_COUNT, TIP_COUNT


@dataclass(frozen=True)
class Sample:
    """Everything that features and rewards depend on; names, shapes and frames as in `states`."""

    joint_q: Array
    joint_qd: Array
    hand_base: Array
    contact_force: Array
    pose: Array
    velocity: Array
    hinge_q: Array
    hinge_qd: Array
    hinge_origin: Array
    hinge_axis: Array
    part_mass: Array
    link_offset: Array
    tip_offset: Array
    active: NDArray[np.int32]
    part: NDArray[np.int32]
    contact_part: NDArray[np.int32]
    wrist_pose_in_part: Array
    finger_angles: Array
    keypoint_in_part: Array
    contacts: Array
    angle: Array
    object_pose: Array
    target_angle: Array
    target_object_pose: Array
    start_object_pose: Array
    start_angle: Array
    steadies: NDArray[np.int32] = field(default_factory=lambda: np.zeros((), np.int32))
    """Whether hands that take no part steady the base."""

    @property
    def engaged(self) -> NDArray[np.int32]:
        """Hands that do not wait."""
        return np.maximum(self.active, self.steadies)

    @property
    def world_count(self) -> int:
        """W."""
        return len(self.joint_q)

    @property
    def hand_count(self) -> int:
        """H."""
        return self.joint_q.shape[1]


@dataclass(frozen=True)
class DeviceSample:
    """A sample as kernel arguments."""

    hands: states.HandState
    objects: states.ObjectState
    object_model: states.ObjectModel
    hand_model: states.HandModel
    goal: states.Goal


def random_poses(rng: np.random.Generator, *shape: int, spread: float = 0.4) -> Array:
    """Poses, position and xyzw: any rotation, positions within ``spread`` of the origin; shape ``[*shape, 7]``."""
    rotations = Rotation.random(int(np.prod(shape)), rng=rng).as_quat().reshape(*shape, 4)
    return np.concatenate([rng.uniform(-spread, spread, (*shape, 3)), rotations], axis=-1)


def random_sample(world_count: int = 100, seed: int = 0) -> Sample:
    """States with a left and a right hand, both parts, all kinds of contact goals, and some hands without any."""
    rng = np.random.default_rng(seed)
    hands = (world_count, 2)
    axis = rng.normal(size=(world_count, 3))
    touched = rng.random((*hands, LINK_COUNT, 2, 1)) < 0.4
    wanted = rng.random((*hands, LINK_COUNT)) < rng.choice([0.0, 0.3, 0.6], (*hands, 1))
    part = rng.integers(0, 2, hands)
    sample = Sample(
        joint_q=rng.uniform(-1.2, 1.2, (*hands, DOF_COUNT)) * np.where(np.arange(DOF_COUNT) < 3, 0.3, 1.0),
        joint_qd=rng.normal(size=(*hands, DOF_COUNT)),
        hand_base=random_poses(rng, *hands),
        contact_force=rng.normal(size=(*hands, LINK_COUNT, 2, 3)) * touched,
        pose=random_poses(rng, world_count),
        velocity=rng.normal(size=(world_count, 6)),
        hinge_q=rng.uniform(0.0, 2.5, world_count),
        hinge_qd=rng.normal(size=world_count),
        hinge_origin=rng.uniform(-0.1, 0.1, (world_count, 3)),
        hinge_axis=axis / np.linalg.norm(axis, axis=-1, keepdims=True),
        part_mass=rng.uniform(0.1, 1.0, (world_count, 2)),
        link_offset=rng.normal(scale=0.03, size=(2, LINK_COUNT, 3)),
        tip_offset=rng.normal(scale=0.03, size=(2, TIP_COUNT, 3)),
        active=(rng.random(hands) < 0.8).astype(np.int32),
        part=part.astype(np.int32),
        contact_part=np.where(rng.random(hands) < 0.5, part, -1).astype(np.int32),
        wrist_pose_in_part=random_poses(rng, *hands),
        finger_angles=rng.uniform(-1.0, 1.0, (*hands, FINGER_DOF_COUNT)),
        keypoint_in_part=rng.uniform(-0.3, 0.3, (*hands, KEYPOINT_COUNT, 3)),
        contacts=wanted.astype(np.float64),
        angle=rng.uniform(0.0, 1.5, world_count),
        start_object_pose=random_poses(rng, world_count),
        start_angle=np.zeros(world_count),
        target_angle=rng.uniform(0.0, 1.5, world_count),
        target_object_pose=random_poses(rng, world_count),
        object_pose=random_poses(rng, world_count),
    )
    # The kernels see float32: the reference must start from the same numbers.
    return replace(
        sample,
        **{
            each.name: value.astype(np.float32).astype(np.float64)
            for each in fields(sample)
            if (value := getattr(sample, each.name)).dtype == np.float64
        },
    )


def mirror_poses(poses: Array) -> Array:
    """Poses (position, xyzw) seen in a mirror across x = 0."""
    return poses * np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0])


def mirror_sample(sample: Sample) -> Sample:
    """The same scene seen in a mirror across x = 0: vectors turn round in x, turning senses about y and z."""
    vector = np.array([-1.0, 1.0, 1.0])
    turn = np.array([1.0, -1.0, -1.0])
    joints = np.concatenate([vector, np.tile(turn, 1 + FINGER_DOF_COUNT // 3)])
    return replace(
        sample,
        joint_q=sample.joint_q * joints,
        joint_qd=sample.joint_qd * joints,
        hand_base=mirror_poses(sample.hand_base),
        contact_force=sample.contact_force * vector,
        pose=mirror_poses(sample.pose),
        velocity=sample.velocity * np.concatenate([vector, turn]),
        hinge_origin=sample.hinge_origin * vector,
        hinge_axis=sample.hinge_axis * turn,
        link_offset=sample.link_offset * vector,
        tip_offset=sample.tip_offset * vector,
        wrist_pose_in_part=mirror_poses(sample.wrist_pose_in_part),
        finger_angles=sample.finger_angles * joints[6:],
        keypoint_in_part=sample.keypoint_in_part * vector,
        start_object_pose=mirror_poses(sample.start_object_pose),
        target_object_pose=mirror_poses(sample.target_object_pose),
        object_pose=mirror_poses(sample.object_pose),
    )


def fill(instance, group, sample: object):
    """Assign those arrays of a struct instance that the sample has; returns the instance."""
    for name in states.element_types(group):
        if hasattr(sample, name):
            getattr(instance, name).assign(getattr(sample, name))
    return instance


def object_slots(sample: Sample, object_count: int) -> states.ObjectSlots:
    """Several objects in every world: in each slot those of the sample, shifted by so many worlds."""
    slots = states.object_slots(sample.world_count, object_count)
    for name in states.element_types(states.ObjectSlots):
        columns = [np.roll(getattr(sample, name), slot, axis=0) for slot in range(object_count)]
        getattr(slots, name).assign(np.stack(columns, axis=1))
    return slots


def to_device(sample: Sample, requires_grad: bool = False) -> DeviceSample:
    """Kernel arguments on Warp's current device."""
    worlds, hands = sample.world_count, sample.hand_count
    return DeviceSample(
        hands=fill(states.hand_state(worlds, hands, requires_grad=requires_grad), states.HandState, sample),
        objects=fill(states.object_state(worlds, requires_grad=requires_grad), states.ObjectState, sample),
        object_model=fill(states.object_model(worlds), states.ObjectModel, sample),
        hand_model=fill(states.hand_model(hands), states.HandModel, sample),
        goal=fill(states.goal(worlds, hands, requires_grad=requires_grad), states.Goal, sample),
    )
