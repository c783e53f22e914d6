"""Several objects in every world: where they stand, and which of them the hands are about."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from artigrasp.config import SimulatorConfig, StageConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.kernels.layout import feature_slice
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.cpu import CpuSimulation
from tests.environment.examples import assert_same, box_environment, play, random_actions, snapshot, task_of
from tests.example_references import box_references

PLACE = np.array([0.5, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0])
"""Of the bystander: beside the object, turned round."""


def first_reference() -> ReferenceSet:
    """One of the box's references."""
    return box_references().select(indices=[0])


@pytest.fixture(scope="module")
def environment() -> Environment:
    """Two worlds with free boxes, another box standing by, and no noise."""
    references = [first_reference()]
    worlds = trial_worlds(references, [0.5, 1.0])
    environment = Environment(
        task_of(fixed_base=False),
        references,
        worlds,
        bystanders=references,
        noise=False,
        simulator=SimulatorConfig(threads=2),
    )
    environment.place_bystander(1, PLACE, 0.4)
    return environment


@pytest.fixture
def started(environment: Environment) -> Environment:
    """At the beginning of an episode."""
    environment.episode.zero_()
    environment.reset()
    return environment


def second_world() -> wp.array:
    """The mask of the second world alone."""
    return wp.array([0, 1], dtype=int, device="cpu")


def test_bystanders_stand_where_they_were_put(started: Environment) -> None:
    """From the reset on, and again after the next one; each world may have its own places."""
    slots = started.state.slots
    np.testing.assert_allclose(slots.pose.numpy()[:, 1], [PLACE] * 2, atol=1e-6)
    np.testing.assert_allclose(slots.hinge_q.numpy()[:, 1], 0.4)
    np.testing.assert_array_equal(slots.pose.numpy()[:, 0], started.state.objects.pose.numpy())
    play(started, random_actions(started, 20))
    found = slots.pose.numpy()[:, 1]
    np.testing.assert_allclose(found[:, :3], [PLACE[:3]] * 2, atol=2e-3, err_msg="it should rest")
    started.place_bystander(1, [PLACE + 0.3 * np.eye(7)[1], PLACE], [0.1, 0.4])
    started.reset(second_world())
    np.testing.assert_array_equal(slots.pose.numpy()[0, 1], found[0], err_msg="only at a reset")
    started.reset()
    np.testing.assert_allclose(slots.pose.numpy()[:, 1, 1], [0.4, 0.1], atol=1e-6)
    np.testing.assert_allclose(slots.hinge_q.numpy()[:, 1], [0.1, 0.4])
    started.place_bystander(1, PLACE, 0.4)


def test_the_hands_are_about_the_object_in_focus(started: Environment) -> None:
    """Features measure to the other object where the focus has changed, and displacements count from where it is."""
    before = started.observe().numpy().copy()
    started.set_focus(1, second_world())
    np.testing.assert_array_equal(started.state.focus.numpy(), [0, 1])
    np.testing.assert_allclose(started.state.objects.pose.numpy()[1], PLACE, atol=1e-6)
    np.testing.assert_allclose(started.goal.start_object_pose.numpy()[1], PLACE, atol=1e-6)
    assert started.goal.start_angle.numpy().tolist() == pytest.approx([0.0, 0.4])
    after = started.observe().numpy()
    columns = feature_slice("part_pose_in_wrist")
    np.testing.assert_array_equal(after[0], before[0])
    assert np.abs(after[1, 0, columns] - before[1, 0, columns]).max() > 0.3
    started.reset()
    np.testing.assert_array_equal(started.state.focus.numpy(), [0, 0])
    np.testing.assert_array_equal(started.observe().numpy(), before, err_msg="a reset brings the first one back")


def test_changing_the_focus_leaves_the_physics_alone(started: Environment) -> None:
    """All objects go on as they would have, in every world."""
    simulation = started.simulation
    assert isinstance(simulation, CpuSimulation)
    actions = random_actions(started, 30)
    play(started, actions)
    expected = simulation.packed.state.copy()
    started.episode.zero_()
    started.reset()
    play(started, actions[:10])
    # the same torques: they follow targets, which are about the object in focus
    targets = started.target.numpy().copy()
    started.set_focus(1)
    started.set_focus(0)
    np.testing.assert_array_equal(started.target.numpy(), targets)
    play(started, actions[10:])
    np.testing.assert_array_equal(simulation.packed.state, expected)


def test_a_bystander_far_away_changes_nothing() -> None:
    """Hands and object go the same way as without it, but for rounding."""
    references = [first_reference()]
    found = []
    for bystanders in ((), references):
        worlds = trial_worlds(references, [1.0])
        each = Environment(
            task_of(), references, worlds, bystanders=bystanders, noise=False, simulator=SimulatorConfig(threads=1)
        )
        each.reset()
        play(each, random_actions(each, 5))
        found.append(snapshot(each))
    for name, array in found[0].items():
        np.testing.assert_allclose(found[1][name], array, atol=1e-3, err_msg=name)


def test_copies_have_their_bystanders_too(environment: Environment) -> None:
    """In the places of the world that they are copies of."""
    environment.place_bystander(1, [PLACE, PLACE + 0.2 * np.eye(7)[0]], [0.1, 0.2])
    copies = environment.repeat(2)
    copies.reset()
    np.testing.assert_allclose(copies.state.slots.pose.numpy()[:, 1, 0], [0.5, 0.5, 0.7, 0.7], atol=1e-6)
    np.testing.assert_allclose(copies.state.slots.hinge_q.numpy()[:, 1], [0.1, 0.1, 0.2, 0.2])
    environment.place_bystander(1, PLACE, 0.4)


def test_slots_that_do_not_exist_are_refused(environment: Environment) -> None:
    """Slot 0 is placed by its references, and there are no more than were asked for."""
    for slot in (0, 2):
        with pytest.raises(ValueError, match=f"slot: expected 1 to 1, found {slot}"):
            environment.place_bystander(slot, PLACE)
    with pytest.raises(ValueError, match="slot: expected 0 to 1, found 2"):
        environment.set_focus(2)


def test_one_object_needs_no_place() -> None:
    """Without bystanders the focus is a constant, and resets do as before."""
    environment = box_environment(task_of(), 2)
    environment.reset()
    before = snapshot(environment)
    environment.set_focus(0)
    assert_same(snapshot(environment), before)


def test_objects_over_the_stage_stand_on_it() -> None:
    """Those beside it stand on the table."""
    references = box_references()
    pose = references.object_pose.copy()
    pose[1, 0] = 0.5
    stage = StageConfig(height=0.2, size=(0.6, 0.4))
    moved = replace(references, object_pose=pose)
    worlds = trial_worlds([moved], [1.0])
    environment = Environment(
        task_of(fixed_base=False, stage=stage), [moved], worlds, noise=False, simulator=SimulatorConfig(threads=1)
    )
    environment.reset()
    np.testing.assert_allclose(environment.state.objects.pose.numpy()[:, 2], [0.2, 0.0, 0.2], atol=1e-6)
    # the pre-grasp pose is relative to the object
    assert np.ptp(environment.state.hands.hand_base.numpy()[[0, 2], 0, 2]) < 0.05
    assert (environment.state.hands.hand_base.numpy()[[0, 2], 0, 2] > 0.2).all()
