"""Episodes that go on from the middle of another."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.environment.environment import Environment
from artigrasp.environment.snapshot import read_instant
from artigrasp.environment.worlds import planned_worlds
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import ARTICULATE, RETREAT
from tests.environment.examples import TWO_THREADS, play, random_actions
from tests.example_references import box_references

TURN = replace(ARTICULATE, reference="first", steadies=False)
SHIFTED = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], np.float32)
BESIDE = np.array([0.6, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0], np.float32)


def two_boxes(*, world_count: int = 1, angle: float = 1.0) -> Environment:
    """Free boxes, of which the first should be opened and the second stands by."""
    references = box_references().select(kind="articulate", indices=[0])
    worlds = planned_worlds([references], [0] * world_count, [0] * world_count, angle)
    environment = Environment(
        get_task("both-free"),
        [references],
        worlds,
        bystanders=[references],
        sequence=(TURN, RETREAT),
        noise=False,
        simulator=TWO_THREADS,
    )
    environment.place_bystander(1, BESIDE, 0.2)
    environment.reset()
    return environment


@pytest.fixture(scope="module")
def opening() -> Environment:
    """In the middle of opening the first box."""
    environment = two_boxes()
    play(environment, random_actions(environment, 180))
    assert 0.2 < environment.state.objects.hinge_q.numpy()[0] < 0.9
    return environment


def test_the_physics_goes_on_as_it_would_have(opening: Environment) -> None:
    """Hands that keep their targets, and the objects that they hold, to what the solver's new start changes."""
    environment = two_boxes(world_count=2)
    instant = read_instant(opening, 0)
    environment.begin_at(instant, np.ones((2, 2), bool), SHIFTED)
    environment.reset()
    assert isinstance(environment.simulation, CpuSimulation) and isinstance(opening.simulation, CpuSimulation)
    columns = slice(1, None)  # but the clock
    begun = opening.simulation.packed.state[0, columns]
    np.testing.assert_allclose(environment.simulation.packed.state[1, columns], begun, atol=1e-6)
    for _ in range(20):
        opening.advance()
        environment.advance()
    expected, found = opening.simulation.packed.state[0, columns], environment.simulation.packed.state
    np.testing.assert_allclose(found[0, columns], expected, atol=5e-3)
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(environment.target.numpy()[1], instant.target)
    np.testing.assert_array_equal(environment.state.hands.hand_base.numpy()[0], instant.hand_base)


def test_an_episode_is_about_what_is_then(opening: Environment) -> None:
    """Start and target of the object, which another may be; hands that take part begin where their wrists are."""
    instant = read_instant(opening, 0)
    environment = two_boxes(angle=-1.0)
    environment.begin_at(instant.in_order([1, 0]), np.array([[True, False]]), SHIFTED)
    environment.reset()
    goal, state = environment.goal, environment.state
    np.testing.assert_array_equal(goal.start_object_pose.numpy()[0], instant.pose[1])
    np.testing.assert_array_equal(environment.phase.start_object_pose.numpy()[0], instant.pose[1])
    np.testing.assert_array_equal(goal.target_object_pose.numpy()[0], SHIFTED)
    assert goal.start_angle.numpy()[0] == goal.target_angle.numpy()[0] == instant.hinge_q[1]
    np.testing.assert_array_equal(state.slots.pose.numpy()[0], instant.pose[[1, 0]])
    np.testing.assert_array_equal(state.slots.hinge_q.numpy()[0], instant.hinge_q[[1, 0]])
    joint_q, wrists = state.hands.joint_q.numpy()[0], state.hands.link_pose.numpy()[0, :, 0]
    assert not joint_q[1, :6].any() and joint_q[0, :6].any()
    np.testing.assert_allclose(wrists[:, :3], opening_wrists(instant.joint_q, instant.hand_base, wrists), atol=1e-5)


def opening_wrists(joint_q: np.ndarray, hand_base: np.ndarray, wrists: np.ndarray) -> np.ndarray:
    """Positions of the wrists [hand, 3] by their coordinates at the instant."""
    turned = [Rotation.from_quat(base[3:]).apply(q[:3]) for base, q in zip(hand_base, joint_q, strict=True)]
    return hand_base[:, :3] + np.array(turned)


def test_only_hands_that_do_not_keep_their_targets_act(opening: Environment) -> None:
    """The other's targets, gains and base frame stay through all phases; episodes can be begun again and copied."""
    instant = read_instant(opening, 0)
    environment = two_boxes()
    environment.begin_at(instant, np.array([[True, False]]), instant.pose[0])
    copies = environment.repeat(2)
    copies.reset()
    action = wp.zeros((2, 2, 1), dtype=float)
    for _ in range(TURN.most_steps + 5):
        copies.step(action)
    assert (copies.phase.index.numpy() == 1).all()
    for name in ("target", "stiffness", "damping"):
        found, expected = getattr(copies, name).numpy(), getattr(instant, name)
        np.testing.assert_array_equal(found[:, 0], np.stack([expected[0]] * 2), err_msg=name)
        assert (found[:, 1] != expected[1]).any() or name == "damping"
    np.testing.assert_array_equal(copies.state.hands.hand_base.numpy()[0, 0], instant.hand_base[0])
    assert copies.episode_summary()["bystander_shift"] == pytest.approx([0.0] * 2, abs=5e-3)
    copies.reset()
    np.testing.assert_array_equal(copies.state.slots.hinge_q.numpy(), np.stack([instant.hinge_q] * 2))


def test_bystanders_that_were_moved_are_told(opening: Environment) -> None:
    """By their shift, and by their turn or that of their hinges, whichever is more."""
    environment = two_boxes()
    pose = environment.state.slots.pose.numpy()
    pose[0, 1] = [0.9, 0.5, 0.0, 0.0, 0.0, np.cos(0.1), np.sin(0.1)]
    environment.state.slots.pose.assign(pose)
    summary = environment.episode_summary()
    assert summary["bystander_shift"] == pytest.approx([0.5], abs=1e-5)
    assert summary["bystander_turn"] == pytest.approx([0.2], abs=1e-5)
    environment.state.slots.hinge_q.assign([[0.0, 1.0]])
    assert environment.episode_summary()["bystander_turn"] == pytest.approx([0.8], abs=1e-5)


def test_an_instant_of_another_scene_is_refused(opening: Environment) -> None:
    """Before anything is written."""
    one = read_instant(opening, 0).in_order([0])
    with pytest.raises(ValueError, match="instant: expected 2 hands and 2 objects, found 2 and 1"):
        opening.begin_at(one, np.zeros((1, 2), bool), SHIFTED)
