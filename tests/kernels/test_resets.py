"""Resets: start poses, goals, noise and determinism."""

from dataclasses import dataclass

import numpy as np
import pytest
import warp as wp

from artigrasp.kernels import states
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.kernels.resets import ReferenceTable, ResetSettings, reset_worlds
from tests.kernels import numpy_reference
from tests.kernels.samples import Sample, fill, random_poses, random_sample

WORLD_COUNT = 200
REFERENCE_COUNT = 20
SETTINGS = {
    "pregrasp_distance": 0.1,
    "idle_distance": 0.3,
    "wrist_clearance": 0.02,
    "idle_clearance": 0.2,
    "open_fraction": 0.3,
    "position_noise": 0.02,
    "angle_noise": 0.05,
    "reference_position_noise": 0.0,
    "reference_rotation_noise": 0.0,
    "goal_lower": 0.5,
    "goal_upper": 1.5,
    "limit_margin": 0.1,
}


@dataclass(frozen=True)
class References:
    """A reference table as NumPy arrays, see `ReferenceTable`."""

    articulate: np.ndarray
    active: np.ndarray
    steadies: np.ndarray
    part: np.ndarray
    wrist_pose_in_part: np.ndarray
    finger_angles: np.ndarray
    contacts: np.ndarray
    object_pose: np.ndarray
    object_angle: np.ndarray


@dataclass(frozen=True)
class HandLimits:
    """Joint limits and offsets of both hands."""

    lower: np.ndarray
    upper: np.ndarray
    link_offset: np.ndarray
    tip_offset: np.ndarray


class Worlds:
    """Worlds that can be reset again and again."""

    def __init__(self, seed: int = 0, **changes: float) -> None:
        rng = np.random.default_rng(0)
        hands = (REFERENCE_COUNT, 2)
        self.sample: Sample = random_sample(WORLD_COUNT)
        self.references = References(
            articulate=rng.integers(0, 2, REFERENCE_COUNT),
            active=rng.integers(0, 2, hands),
            steadies=np.zeros(hands, int),
            part=rng.integers(0, 2, hands),
            wrist_pose_in_part=random_poses(rng, *hands, spread=0.3).astype(np.float32).astype(float),
            finger_angles=rng.uniform(-1.0, 1.0, (*hands, 45)).astype(np.float32).astype(float),
            contacts=rng.integers(0, 2, (*hands, 16)),
            object_pose=random_poses(rng, REFERENCE_COUNT, spread=0.2) + np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0]),
            object_angle=rng.uniform(0.0, 0.5, REFERENCE_COUNT),
        )
        self.limits = HandLimits(
            lower=rng.uniform(-1.0, -0.2, (2, DOF_COUNT)),
            upper=rng.uniform(0.2, 1.0, (2, DOF_COUNT)),
            link_offset=self.sample.link_offset,
            tip_offset=self.sample.tip_offset,
        )
        self.table = ReferenceTable()
        for name, dtype in states.element_types(ReferenceTable).items():
            setattr(self.table, name, wp.array(getattr(self.references, name), dtype=dtype))
        self.settings = ResetSettings()
        for name, value in (SETTINGS | changes).items():
            setattr(self.settings, name, value)
        self.seed = seed
        self.index = rng.integers(0, REFERENCE_COUNT, WORLD_COUNT)
        self.episode = wp.zeros(WORLD_COUNT, dtype=int)
        self.hand_model = fill(states.hand_model(2), states.HandModel, self.limits)
        self.object_model = fill(states.object_model(WORLD_COUNT), states.ObjectModel, self.sample)
        self.hands = fill(states.hand_state(WORLD_COUNT, 2), states.HandState, self.sample)
        self.objects = fill(states.object_state(WORLD_COUNT), states.ObjectState, self.sample)
        self.goal = states.goal(WORLD_COUNT, 2)
        self.phase = states.phase_state(WORLD_COUNT)
        self.target_offset = random_poses(rng, WORLD_COUNT)

    def reset(self, mask: np.ndarray | None = None, goal_angle: np.ndarray | float = -1.0) -> "Worlds":
        """Reset the masked worlds, by default all; returns self."""
        mask = np.ones(WORLD_COUNT) if mask is None else mask
        wp.launch(
            reset_worlds,
            dim=WORLD_COUNT,
            inputs=[
                wp.array(mask, dtype=int),
                wp.array(self.index, dtype=int),
                wp.array(np.broadcast_to(goal_angle, WORLD_COUNT), dtype=float),
                wp.array(self.target_offset, dtype=wp.transform),
                self.episode,
                self.seed,
                self.table,
                self.settings,
                self.hand_model,
                self.object_model,
                self.hands,
                self.objects,
                self.goal,
                self.phase,
            ],
        )
        return self

    def of_world(self, name: str) -> np.ndarray:
        """A column of the reference table, looked up for every world."""
        return getattr(self.references, name)[self.index]

    def reference_wrist(self) -> numpy_reference.Frame:
        """[W, H] reference wrist frames in the world, on the object at its start angle."""
        base = numpy_reference.frame(self.of_world("object_pose"))
        angle = self.of_world("object_angle")
        turn = numpy_reference.Rotation.from_rotvec(self.sample.hinge_axis * angle[:, None]).as_matrix()
        shift = self.sample.hinge_origin - numpy_reference.turned(turn, self.sample.hinge_origin)
        lid = numpy_reference.compose(base, (turn, shift))
        on_lid = self.of_world("part") == 1
        matrix = np.where(on_lid[..., None, None], lid[0][:, None], base[0][:, None])
        origin = np.where(on_lid[..., None], lid[1][:, None], base[1][:, None])
        return numpy_reference.compose((matrix, origin), numpy_reference.frame(self.of_world("wrist_pose_in_part")))


@pytest.fixture(scope="module")
def worlds() -> Worlds:
    """All worlds after one reset."""
    return Worlds().reset()


def test_hands_start_back_from_the_reference(worlds: Worlds) -> None:
    """10 cm (idle: 30 cm) away from the object's origin, turned as the reference, over the table, idle ones higher."""
    rotation, position = worlds.reference_wrist()
    outward = position - worlds.of_world("object_pose")[:, None, :3]
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    active = worlds.of_world("active") == 1
    expected = position + np.where(active, 0.1, 0.3)[..., None] * outward
    assert (expected[..., 2] < 0.02).any() and (expected[~active, 2] < 0.2).any()
    expected[..., 2] = np.maximum(expected[..., 2], np.where(active, 0.02, 0.2))
    found = numpy_reference.frame(worlds.hands.hand_base.numpy())
    np.testing.assert_allclose(found[1], expected, atol=1e-5)
    np.testing.assert_allclose(found[0], rotation, atol=1e-5)


def test_a_wrist_at_the_object_origin_goes_up() -> None:
    """Without a direction to move away in, the way is up."""
    worlds = Worlds()
    pose = np.zeros((REFERENCE_COUNT, 2, 7))
    pose[..., 6] = 1.0
    worlds.table.wrist_pose_in_part.assign(pose)
    worlds.table.part.zero_()
    base = worlds.reset().hands.hand_base.numpy()
    expected = worlds.of_world("object_pose")[:, None, :3].repeat(2, axis=1)
    active = worlds.of_world("active") == 1
    expected[..., 2] = np.maximum(expected[..., 2] + np.where(active, 0.1, 0.3), np.where(active, 0.02, 0.2))
    np.testing.assert_allclose(base[..., :3], expected, atol=1e-5)


def test_noise_is_uniform_within_its_bounds(worlds: Worlds) -> None:
    """Joint coordinates spread evenly around the start pose, within 2 cm and 0.05 rad; velocities are zero."""
    joint_q = worlds.hands.joint_q.numpy().astype(float)
    free = worlds.hands.hand_base.numpy()[..., 2] > 0.02 + 0.02 * np.sqrt(3.0)
    translation = joint_q[free][:, :3]
    angles = joint_q[..., 3:].copy()
    angles[..., 3:] -= 0.3 * worlds.of_world("finger_angles")
    for noise, bound in ((translation, 0.02), (angles, 0.05)):
        assert np.abs(noise).max() <= bound + 1e-6
        assert np.abs(noise.mean()) < 0.05 * bound
        np.testing.assert_allclose(noise.std(), bound / np.sqrt(3.0), rtol=0.05)
    correlation = np.corrcoef(angles.reshape(-1, 48).T) - np.eye(48)
    assert np.abs(correlation).max() < 0.25
    assert (worlds.hands.joint_qd.numpy() == 0.0).all()
    assert (worlds.hands.contact_force.numpy() == 0.0).all()


def test_no_wrist_starts_below_its_clearance(worlds: Worlds) -> None:
    """Noise is shortened where it would take a wrist below 2 cm, and only there."""
    base = numpy_reference.frame(worlds.hands.hand_base.numpy())
    wrist = base[1] + numpy_reference.turned(base[0], worlds.hands.joint_q.numpy()[..., :3])
    assert (base[1][..., 2] < 0.021).any()
    assert wrist[..., 2].min() > 0.02 - 1e-6
    assert np.linalg.norm(worlds.hands.joint_q.numpy()[..., :3], axis=-1).max() < 0.02 * np.sqrt(3.0) + 1e-6


def test_without_noise_hands_start_in_the_open_reference() -> None:
    """Wrist coordinates are zero and the fingers at their fraction of the reference."""
    joint_q = Worlds(position_noise=0.0, angle_noise=0.0).reset().hands.joint_q.numpy()
    assert (joint_q[..., :6] == 0.0).all()
    np.testing.assert_allclose(joint_q[..., 6:], 0.3 * Worlds().of_world("finger_angles"), rtol=1e-5)


def test_objects_start_as_the_reference_says(worlds: Worlds) -> None:
    """Pose and angle of the reference, at rest; the goal remembers them."""
    pose, angle = worlds.of_world("object_pose"), worlds.of_world("object_angle")
    for array in (worlds.objects.pose, worlds.goal.start_object_pose):
        np.testing.assert_allclose(array.numpy(), pose, atol=1e-6)
    for array in (worlds.objects.hinge_q, worlds.goal.start_angle):
        np.testing.assert_allclose(array.numpy(), angle, rtol=1e-6)
    assert (worlds.objects.velocity.numpy() == 0.0).all()
    assert (worlds.objects.hinge_qd.numpy() == 0.0).all()


def test_goals_are_the_reference(worlds: Worlds) -> None:
    """Everything that hands are asked for is the reference's; articulation counts contacts with its part only."""
    goal = worlds.goal
    for name in ("active", "part", "wrist_pose_in_part", "finger_angles", "contacts"):
        np.testing.assert_allclose(getattr(goal, name).numpy(), worlds.of_world(name), rtol=1e-6)
    articulate = worlds.of_world("articulate")[:, None] == 1
    np.testing.assert_array_equal(goal.contact_part.numpy(), np.where(articulate, worlds.of_world("part"), -1))


def test_goal_keypoints_are_the_references_kinematics(worlds: Worlds) -> None:
    """Links and keypoints of the reference hand in the part's frame."""
    links, keypoints = numpy_reference.hand_frames(
        numpy_reference.frame(worlds.of_world("wrist_pose_in_part")),
        worlds.of_world("finger_angles"),
        worlds.limits.link_offset,
        worlds.limits.tip_offset,
    )
    np.testing.assert_allclose(worlds.goal.keypoint_in_part.numpy(), keypoints, atol=1e-6)
    origins = np.stack([link[1] for link in links], axis=2)
    np.testing.assert_allclose(worlds.goal.link_pose_in_part.numpy()[..., :3], origins, atol=1e-6)


def test_references_are_drawn_from_a_neighbourhood(worlds: Worlds) -> None:
    """Noise on the reference moves the goal, and the start with it, by a bounded shift and turn in the part's frame."""
    noisy = Worlds(reference_position_noise=0.01, reference_rotation_noise=0.1).reset()
    exact, found = (numpy_reference.frame(each.goal.wrist_pose_in_part.numpy()) for each in (worlds, noisy))
    turn = numpy_reference.rotation_vector(found[0] @ np.swapaxes(exact[0], -1, -2))
    for noise, bound in ((found[1] - exact[1], 0.01), (turn, 0.1)):
        assert np.abs(noise).max() < bound + 1e-5
        np.testing.assert_allclose(noise.std(), bound / np.sqrt(3.0), rtol=0.1)
    keypoints = noisy.goal.keypoint_in_part.numpy()[..., 0, :]
    np.testing.assert_array_equal(keypoints, noisy.goal.wrist_pose_in_part.numpy()[..., :3])
    start = numpy_reference.compose(
        numpy_reference.frame(noisy.hands.hand_base.numpy()),
        numpy_reference.inverse(numpy_reference.frame(worlds.hands.hand_base.numpy())),
    )
    part = numpy_reference.compose(
        worlds.reference_wrist(), numpy_reference.inverse(numpy_reference.frame(worlds.of_world("wrist_pose_in_part")))
    )
    turn_in_world = numpy_reference.turned(part[0], turn)
    np.testing.assert_allclose(numpy_reference.rotation_vector(start[0]), turn_in_world, atol=1e-4)


def test_effective_limits_contain_the_reference(worlds: Worlds) -> None:
    """The hand's limits, widened to 0.1 rad around the reference where that is outside; the wrist's as they are."""
    lower, upper = worlds.goal.lower.numpy(), worlds.goal.upper.numpy()
    angles = worlds.of_world("finger_angles")
    np.testing.assert_allclose(lower[..., 6:], np.minimum(worlds.limits.lower[:, 6:], angles - 0.1), atol=1e-6)
    np.testing.assert_allclose(upper[..., 6:], np.maximum(worlds.limits.upper[:, 6:], angles + 0.1), atol=1e-6)
    np.testing.assert_allclose(lower[..., :6], np.broadcast_to(worlds.limits.lower[:, :6], lower[..., :6].shape))
    np.testing.assert_allclose(upper[..., :6], np.broadcast_to(worlds.limits.upper[:, :6], upper[..., :6].shape))


def test_goal_angles(worlds: Worlds) -> None:
    """Drawn for articulation, the start angle for grasping, or what is asked for."""
    angle = worlds.goal.target_angle.numpy()
    articulate = worlds.of_world("articulate") == 1
    assert articulate.any() and not articulate.all()
    assert angle[articulate].min() > 0.5 and angle[articulate].max() < 1.5
    np.testing.assert_allclose(angle[articulate].mean(), 1.0, atol=0.1)
    np.testing.assert_allclose(angle[~articulate], worlds.of_world("object_angle")[~articulate], rtol=1e-6)
    asked = np.where(np.arange(WORLD_COUNT) < 50, 0.75, -1.0)
    found = Worlds().reset(goal_angle=asked).goal.target_angle.numpy()
    np.testing.assert_array_equal(found[:50], 0.75)
    np.testing.assert_array_equal(found[50:], angle[50:])


def test_the_target_of_the_object_is_shifted_and_turned(worlds: Worlds) -> None:
    """Both along the world's axes, the turn about the base's own origin."""
    start, offset = (numpy_reference.frame(each) for each in (worlds.of_world("object_pose"), worlds.target_offset))
    found = numpy_reference.frame(worlds.goal.target_object_pose.numpy())
    np.testing.assert_allclose(found[1], start[1] + offset[1], atol=1e-5)
    np.testing.assert_allclose(found[0], offset[0] @ start[0], atol=1e-5)


def test_the_first_phase_begins() -> None:
    """All clocks and counts are zero, and the object is where it starts."""
    worlds = Worlds()
    for name, dtype in states.element_types(states.PhaseState).items():
        array = getattr(worlds.phase, name)
        if dtype is wp.int32:
            array.fill_(5)
    worlds.reset()
    for name, dtype in states.element_types(states.PhaseState).items():
        if dtype is wp.int32:
            assert (getattr(worlds.phase, name).numpy() == 0).all(), name
    np.testing.assert_allclose(worlds.phase.start_object_pose.numpy(), worlds.of_world("object_pose"), atol=1e-6)


def test_same_seed_same_episodes() -> None:
    """The noise follows from seed, world and number of resets alone."""
    first, second, other = Worlds(seed=1).reset(), Worlds(seed=1).reset(), Worlds(seed=2).reset()
    np.testing.assert_array_equal(first.hands.joint_q.numpy(), second.hands.joint_q.numpy())
    assert (first.hands.joint_q.numpy() != other.hands.joint_q.numpy()).mean() > 0.99
    # World 3 is reset alone in between, which must not change what the others see.
    alone = np.arange(WORLD_COUNT) == 3
    first.reset().reset()
    second.reset(~alone).reset(~alone).reset(alone).reset(alone)
    np.testing.assert_array_equal(first.hands.joint_q.numpy(), second.hands.joint_q.numpy())
    np.testing.assert_array_equal(first.goal.target_angle.numpy(), second.goal.target_angle.numpy())
    assert (first.episode.numpy() == 3).all()


def test_episodes_and_worlds_differ() -> None:
    """Another episode and another world mean other noise."""
    worlds = Worlds()
    first, second = (worlds.reset().hands.joint_q.numpy()[..., :6].copy() for _ in range(2))
    assert (first != second).mean() > 0.99
    assert len(np.unique(first[:, 0, 3])) == WORLD_COUNT


def test_only_masked_worlds_are_reset() -> None:
    """The others keep every number."""
    worlds = Worlds()
    worlds.reset()
    worlds.hands.joint_q.fill_(7.0)
    worlds.objects.hinge_q.fill_(7.0)
    mask = np.arange(WORLD_COUNT) % 3 == 0
    worlds.reset(mask)
    assert (worlds.hands.joint_q.numpy()[~mask] == 7.0).all()
    assert (worlds.objects.hinge_q.numpy()[~mask] == 7.0).all()
    assert (worlds.hands.joint_q.numpy()[mask] != 7.0).all()
    np.testing.assert_array_equal(worlds.episode.numpy(), np.where(mask, 2, 1))
