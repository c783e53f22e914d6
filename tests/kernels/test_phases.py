"""The phase machine on states made by hand, and bases that move without anything moving in the world."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.config import PDGain, PDGains, PhaseConfig
from artigrasp.environment.tables import phase_limits, phase_table
from artigrasp.kernels import states
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.kernels.phase_starts import begin_phases, set_phase_goal
from artigrasp.kernels.phases import OUTCOMES, advance_phases, reset_outcomes
from tests.kernels import numpy_reference
from tests.kernels.samples import random_poses
from tests.kernels.test_resets import REFERENCE_COUNT, WORLD_COUNT, Worlds

GRASP = PhaseConfig("grasp", 60, least_steps=20, aim="grasp", opens=False)
CARRY = PhaseConfig("carry", 50, aim="object", carries=True, lift=0.1, opens=False)
OPEN = PhaseConfig("open", 40, aim="hinge", reference="second")
REST = PhaseConfig("rest", 5)


class OneWorld:
    """One world with two hands, of which the right one takes part, and an object at its goal, at rest, in touch."""

    def __init__(self, *phases: PhaseConfig, retry_count: int = 0) -> None:
        self.table, self.limits = phase_table(phases, "cpu"), phase_limits(retry_count)
        self.hands, self.objects = states.hand_state(1, 2), states.object_state(1)
        self.goal, self.phase = states.goal(1, 2), states.phase_state(1)
        identity = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
        for pose in (self.objects.pose, self.goal.object_pose, self.phase.start_object_pose):
            pose.assign(identity)
        self.goal.active.assign([[0, 1]])
        self.goal.contact_part.fill_(-1)
        self.touch()
        self.target = wp.zeros((1, 2, DOF_COUNT), dtype=float)
        self.outcome = wp.zeros((1, len(phases)), dtype=int)
        self.begins = wp.zeros(1, dtype=int)
        self.history: list[int] = []

    def touch(self, force: float = 1.0) -> "OneWorld":
        """The right thumb presses on the lid, or no longer."""
        forces = np.zeros((*self.hands.contact_force.shape, 3), np.float32)
        forces[0, 1, 15, 1, 2] = force
        self.hands.contact_force.assign(forces)
        return self

    def move(
        self, position: tuple[float, float, float] = (0, 0, 0), turn: tuple[float, float, float] = (0, 0, 0)
    ) -> None:
        """Place the object."""
        self.objects.pose.assign([[*position, *Rotation.from_rotvec(turn).as_quat()]])

    def run(self, steps: int) -> str:
        """Let control steps pass; what became of the phase that ran last."""
        for _ in range(steps):
            running = int(self.phase.index.numpy()[0])
            self.phase.step.assign(self.phase.step.numpy() + 1)
            inputs = [self.hands, self.objects, self.goal, self.target, self.table, self.limits]
            wp.launch(advance_phases, dim=1, inputs=inputs, outputs=[self.phase, self.outcome, self.begins])
            if self.begins.numpy()[0]:
                self.history.append(running)
                self.phase.step.zero_()
                self.phase.settled_steps.zero_()
                self.phase.untouched_steps.zero_()
        return OUTCOMES[self.outcome.numpy()[0, running]]


def test_a_grasp_ends_once_it_is_stable() -> None:
    """Not before its least steps, and after ten steps in a row in touch and at rest."""
    world = OneWorld(GRASP, REST)
    assert world.run(19) == "running"
    assert world.run(1) == "done" and world.phase.index.numpy()[0] == 1
    late = OneWorld(GRASP, REST).touch(0.0)
    late.run(25)
    late.touch()
    assert late.run(9) == "running"
    assert late.run(1) == "done"


@pytest.mark.parametrize(("velocity", "outcome"), [(0.02, "done"), (0.05, "not grasped")])
def test_an_object_that_moves_is_not_grasped(velocity: float, outcome: str) -> None:
    """The time is up after the most steps, and the next phase begins all the same."""
    world = OneWorld(GRASP, REST)
    world.objects.velocity.assign([[velocity, 0.0, 0.0, 0.0, 0.0, 0.0]])
    assert world.run(60 if outcome != "done" else 20) == outcome
    assert world.history == [0]


def test_every_hand_that_takes_part_must_touch() -> None:
    """One of two is not enough; the force counts only if the part counts."""
    world = OneWorld(GRASP, REST)
    world.goal.active.fill_(1)
    assert world.run(60) == "not grasped"
    world = OneWorld(GRASP, REST)
    world.goal.contact_part.fill_(0)
    assert world.run(60) == "not grasped"


@pytest.mark.parametrize(
    ("position", "turn", "outcome"),
    [
        ((0.01, 0.0, 0.01), (0.0, 0.05, 0.0), "done"),
        ((0.05, 0.0, 0.0), (0.0, 0.0, 0.0), "not reached"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.2), "not reached"),
        ((0.0, 0.0, -0.2), (0.0, 0.0, 0.0), "slipped"),
    ],
)
def test_a_carried_object_arrives_or_not(position: Any, turn: Any, outcome: str) -> None:
    """Position and rotation count; far from its goal, though touched, it slipped; tilting is no matter in the air."""
    world = OneWorld(CARRY, REST)
    world.move(position, turn)
    assert world.run(10 if outcome == "done" else 50) == outcome


def test_an_object_that_nobody_touches_is_dropped() -> None:
    """After twenty steps without touch, not sooner, and a touch in between starts the count again."""
    world = OneWorld(CARRY, REST)
    world.move((0.0, 0.0, -0.3))
    world.touch(0.0).run(19)
    world.touch().run(1)
    assert world.touch(0.0).run(19) == "running"
    assert world.run(1) == "dropped"


@pytest.mark.parametrize("phase", [GRASP, OPEN, REST])
def test_a_standing_object_topples(phase: PhaseConfig) -> None:
    """Turning about the vertical is no toppling; in the air it is none either, nor of what falls as it should."""
    world = OneWorld(phase, REST)
    world.move(turn=(0.0, 0.0, 2.0))
    assert world.run(1) == "running"
    world.move(turn=(0.0, 0.8, 0.0))
    assert world.run(1) == "toppled"
    carried = OneWorld(CARRY, REST)
    dropped = OneWorld(replace(phase, drops=True), REST)
    for world in (carried, dropped):
        world.move(turn=(0.0, 0.8, 0.0))
        assert world.run(1) == "running"


def test_the_hinge_and_the_hands_arrive() -> None:
    """The hinge within 0.05 rad of what is asked; wrists near their targets, or else when the time is up."""
    world = OneWorld(OPEN, REST)
    world.goal.angle.assign([1.0])
    world.objects.hinge_q.assign([0.9])
    assert world.run(40) == "not reached"
    world = OneWorld(OPEN, REST)
    world.goal.angle.assign([1.0])
    world.objects.hinge_q.assign([0.96])
    assert world.run(10) == "done"
    away = OneWorld(PhaseConfig("back", 30, aim="hands"), REST)
    target = np.zeros((1, 2, DOF_COUNT))
    target[0, 0, 4] = 0.3
    away.target.assign(target)
    assert away.run(29) == "running"
    assert away.run(1) == "done"


def test_the_last_phase_goes_on() -> None:
    """It ends once; then nothing begins, and what became of it stays."""
    world = OneWorld(REST)
    assert world.run(5) == "done"
    assert world.phase.finished.numpy()[0] == 1
    world.move(turn=(0.0, 0.8, 0.0))
    assert world.run(50) == "done" and world.history == []


def test_a_failed_phase_is_tried_again() -> None:
    """Back to the named phase, as often as is allowed; then the next follows."""
    carry = PhaseConfig("carry", 50, aim="object", carries=True, retry_from="grasp")
    world = OneWorld(GRASP, carry, REST, retry_count=2)
    world.move((0.3, 0.0, 0.0))
    for _ in range(3):
        world.touch().run(20)
        world.touch(0.0).run(20)
    assert world.history == [0, 1, 0, 1, 0, 1]
    assert world.phase.retry_count.numpy()[0] == 2
    assert [OUTCOMES[each] for each in world.outcome.numpy()[0]] == ["done", "dropped", "not begun"]
    wp.launch(reset_outcomes, dim=1, inputs=[wp.zeros(1, dtype=int)], outputs=[world.outcome])
    assert world.outcome.numpy().any()
    wp.launch(reset_outcomes, dim=1, inputs=[wp.ones(1, dtype=int)], outputs=[world.outcome])
    assert not world.outcome.numpy().any()


@pytest.mark.parametrize(
    ("position", "turn", "outcome"),
    [
        ((0.03, 0.0, 0.0), (0.0, 0.0, 0.1), "done"),
        ((0.05, 0.0, 0.0), (0.0, 0.0, 0.0), "not reached"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.2), "not reached"),
    ],
)
def test_what_is_put_down_elsewhere_is_grasped_again(position: Any, turn: Any, outcome: str) -> None:
    """A phase that places looks where the object is when it is over, and goes back if that is not its target."""
    leave = replace(REST, name="leave", places=True, retry_from="grasp")
    world = OneWorld(GRASP, leave, REST, retry_count=1)
    world.goal.target_object_pose.assign([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    world.run(20)
    world.move(position, turn)
    assert world.run(5) == outcome
    assert world.phase.index.numpy()[0] == (2 if outcome == "done" else 0)


def test_hands_that_hold_an_object_do_not_try_again() -> None:
    """An object that is held, but not where it should be, is carried on; it would fall if the hands began anew."""
    carry = PhaseConfig("carry", 50, aim="object", carries=True, retry_from="grasp")
    world = OneWorld(GRASP, carry, REST, retry_count=2)
    world.move((0.3, 0.0, 0.0))
    world.run(20 + 50 + 1)
    assert world.history == [0, 1] and world.phase.retry_count.numpy()[0] == 0
    assert [OUTCOMES[each] for each in world.outcome.numpy()[0]] == ["done", "slipped", "running"]


def test_a_phase_asks_for_its_part_of_the_target() -> None:
    """Carried: to the target, lifted; standing: to stay. The hinge as it was, or to its target. Helpers, gains."""
    stiff = PDGains(PDGain(500.0, 30.0), PDGain(40.0, 1.0), PDGain(10.0, 0.5))
    table = phase_table([GRASP, PhaseConfig("carry", 9, carries=True, lift=0.1, steadies=True, gains=stiff)], "cpu")
    rng = np.random.default_rng(0)
    worlds, goal, phase, objects = 6, states.goal(6, 2), states.phase_state(6), states.object_state(6)
    index, mask = np.arange(worlds) % 2, np.arange(worlds) < 4
    target, pose = random_poses(rng, worlds), random_poses(rng, worlds)
    for array, value in ((goal.target_object_pose, target), (objects.pose, pose), (phase.index, index)):
        array.assign(value.astype(np.int32 if value.ndim == 1 else np.float32))
    goal.target_angle.fill_(1.5)
    goal.start_angle.fill_(0.25)
    gains = [wp.zeros((worlds, 2, 3), dtype=float) for _ in range(2)]
    references = Worlds().table
    references.steadies.assign(np.tile([1, 0], (REFERENCE_COUNT, 1)))
    goal.active.assign(np.tile([0, 1], (worlds, 1)))
    inputs = [wp.array(mask, dtype=int), references, wp.zeros(worlds, dtype=int), table, objects, phase]
    wp.launch(set_phase_goal, dim=worlds, inputs=inputs, outputs=[goal, *gains])
    asked = np.where(index[:, None] == 1, target + np.eye(7)[2] * 0.1, pose)
    np.testing.assert_allclose(goal.object_pose.numpy()[mask], asked[mask], atol=1e-6)
    np.testing.assert_array_equal(goal.angle.numpy()[mask], np.where(index == 1, 1.5, 0.25)[mask])
    np.testing.assert_array_equal(goal.engaged.numpy()[:4], [[0, 1], [1, 1]] * 2)
    stiffness, damping = (each.numpy() for each in gains)
    np.testing.assert_allclose(stiffness[1], [[500.0, 40.0, 10.0]] * 2)
    np.testing.assert_allclose(damping[1], [[30.0, 1.0, 0.5]] * 2)
    assert not stiffness[~mask].any() and not goal.object_pose.numpy()[~mask].any()


def test_an_object_is_raised_from_where_it_is() -> None:
    """Not over its target."""
    world = OneWorld(PhaseConfig("raise", 9, aim="object", carries=True, lift=0.2, raises=True))
    world.move((0.3, 0.1, 0.02), (0.0, 0.1, 0.0))
    gains = [wp.zeros((1, 2, 3), dtype=float) for _ in range(2)]
    every, first = wp.ones(1, dtype=int), wp.zeros(1, dtype=int)
    inputs = [every, Worlds().table, first, world.table, world.objects, world.phase]
    wp.launch(set_phase_goal, dim=1, inputs=inputs, outputs=[world.goal, *gains])
    expected = world.objects.pose.numpy()[0] + np.eye(7)[2] * 0.2
    np.testing.assert_allclose(world.goal.object_pose.numpy()[0], expected, atol=1e-6)


def test_a_phase_begins_where_the_wrists_are() -> None:
    """The base moves to the wrist; poses and velocities in the world stay; the goal is the phase's reference's."""
    worlds = Worlds(position_noise=0.0)
    worlds.reset()
    sample = worlds.sample
    rng = np.random.default_rng(3)
    for name in ("joint_q", "joint_qd", "hand_base"):
        getattr(worlds.hands, name).assign(getattr(sample, name).astype(np.float32))
    table = phase_table([GRASP, OPEN], "cpu")
    worlds.phase.index.fill_(1)
    references = rng.integers(0, REFERENCE_COUNT, (WORLD_COUNT, 2))
    mask = np.arange(WORLD_COUNT) % 2 == 0
    index = wp.full(WORLD_COUNT, -1, dtype=int)
    wp.launch(
        begin_phases,
        dim=WORLD_COUNT,
        inputs=[
            wp.array(mask, dtype=int), worlds.table, wp.array(references, dtype=int), table, phase_limits(0),
            worlds.hand_model, worlds.objects,
        ],
        outputs=[index, worlds.hands, worlds.goal, worlds.phase],
    )  # fmt: skip
    np.testing.assert_array_equal(index.numpy(), np.where(mask, references[:, 1], -1))
    columns = ("joint_q", "joint_qd", "hand_base")
    after = vars(sample) | {name: getattr(worlds.hands, name).numpy().astype(float) for name in columns}
    moved = type(sample)(**after)
    assert not moved.joint_q[mask][..., :6].any()
    np.testing.assert_array_equal(moved.joint_q[..., 6:], sample.joint_q[..., 6:].astype(np.float32))
    np.testing.assert_array_equal(moved.hand_base[~mask], sample.hand_base[~mask].astype(np.float32))
    for found, expected in zip(
        numpy_reference.forward_kinematics(moved)[0], numpy_reference.forward_kinematics(sample)[0], strict=True
    ):
        np.testing.assert_allclose(found[1], expected[1], atol=1e-5)
        np.testing.assert_allclose(found[0], expected[0], atol=1e-5)
    for found, expected in zip(
        numpy_reference.wrist_velocity(moved), numpy_reference.wrist_velocity(sample), strict=True
    ):
        np.testing.assert_allclose(found, expected, atol=2e-5)
    played = references[mask, 1]
    for name in ("active", "part", "wrist_pose_in_part", "finger_angles"):
        expected = getattr(worlds.references, name)[played]
        np.testing.assert_allclose(getattr(worlds.goal, name).numpy()[mask], expected, atol=1e-6)


def test_a_reference_that_is_played_on_keeps_its_noise() -> None:
    """The hand that has grasped with the noise of the reset carries with it; another reference comes without."""
    worlds = Worlds(reference_position_noise=0.01, reference_rotation_noise=0.1)
    worlds.reset()
    noisy, played = worlds.goal.wrist_pose_in_part.numpy(), worlds.index
    assert np.abs(noisy - worlds.references.wrist_pose_in_part[played]).max() > 0.005
    other = (played + 1) % REFERENCE_COUNT
    is_another = np.arange(WORLD_COUNT) % 2 == 1
    references = np.where(is_another, other, played)
    worlds.phase.index.fill_(1)
    wp.launch(
        begin_phases,
        dim=WORLD_COUNT,
        inputs=[
            wp.full(WORLD_COUNT, 1, dtype=int), worlds.table, wp.array(np.stack([references] * 2, axis=1), dtype=int),
            phase_table([GRASP, CARRY], "cpu"), phase_limits(0), worlds.hand_model, worlds.objects,
        ],
        outputs=[wp.array(played, dtype=int), worlds.hands, worlds.goal, worlds.phase],
    )  # fmt: skip
    found = worlds.goal.wrist_pose_in_part.numpy()
    np.testing.assert_array_equal(found[~is_another], noisy[~is_another])
    expected = worlds.references.wrist_pose_in_part[other]
    np.testing.assert_allclose(found[is_another], expected[is_another], atol=1e-6)
