"""Scenes of several objects and of a stage, on both backends."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from artigrasp.assets.object import load_object
from artigrasp.config import StageConfig
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.simulation.backend import Simulation
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.simulation.scene import Scene
from tests.simulation.scenes import open_scene

Backend = Callable[..., Simulation]
BACKENDS = (CpuSimulation, NewtonSimulation)


def two_boxes(fixed_base: bool) -> Scene:
    """A right hand and two boxes."""
    return replace(open_scene(fixed_base), objects=(load_object("lidded-box"),) * 2)


def start(simulation: Simulation, positions: np.ndarray, hand_position: tuple[float, float, float]) -> None:
    """Objects upright at these positions, [object, 3], in every world, and hands over them."""
    slots, hands = simulation.state.slots, simulation.state.hands
    pose = np.zeros(slots.pose.numpy().shape, dtype=np.float32)
    pose[..., :3], pose[..., 6] = positions, 1.0
    slots.pose.assign(pose)
    base = np.zeros(hands.hand_base.numpy().shape, dtype=np.float32)
    base[..., :3], base[..., 6] = hand_position, 1.0
    hands.hand_base.assign(base)
    simulation.state.read_focus()
    simulation.write_state(everyone(simulation))


def everyone(simulation: Simulation) -> wp.array:
    """The mask of all worlds."""
    return wp.full(simulation.world_count, 1, dtype=int, device="cpu")


def press_down(simulation: Simulation, force: float = 10.0) -> Callable[[slice], None]:
    """A force on the wrist [N], and fingers held where they are."""
    torque = np.zeros(simulation.joint_torque.shape, dtype=np.float32)
    torque[..., 2] = -force
    assert torque.shape[2] == DOF_COUNT
    simulation.joint_torque.assign(torque)
    return lambda rows: None


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("fixed_base", [True, False], ids=["fixed", "free"])
def test_every_object_keeps_its_slot(backend: Backend, fixed_base: bool) -> None:
    """What was written in a slot comes back in it, world by world, and the first slot is in focus."""
    simulation = backend([two_boxes(fixed_base)], [3])
    rng = np.random.default_rng(0)
    start(simulation, [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], (0.0, 0.0, 3.0))
    angle = rng.uniform(0.2, 0.8, (3, 2)).astype(np.float32)
    simulation.state.slots.hinge_q.assign(angle)
    simulation.state.read_focus()
    simulation.write_state(everyone(simulation))
    before = simulation.state.slots.pose.numpy().copy()
    simulation.step(lambda rows: None)
    found = simulation.state.slots
    np.testing.assert_allclose(found.pose.numpy(), before, atol=1e-3)
    np.testing.assert_allclose(found.hinge_q.numpy(), angle, atol=5e-3)
    np.testing.assert_array_equal(simulation.state.objects.hinge_q.numpy(), found.hinge_q.numpy()[:, 0])


@pytest.mark.parametrize("backend", BACKENDS)
def test_contact_forces_are_those_of_the_focus(backend: Backend) -> None:
    """A hand presses on the second box: it feels it in the world where that one is in focus, and not in the other."""
    simulation = backend([two_boxes(True)], [2])
    start(simulation, [[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]], (0.1, 0.0, 0.14))
    simulation.state.set_focus(1, wp.array([0, 1], dtype=int, device="cpu"))
    torques = press_down(simulation)
    for _ in range(10):
        simulation.step(torques)
    force = simulation.state.hands.contact_force.numpy()
    assert (force[0] == 0).all()
    assert force[1, 0, :, :, 2].sum() > 1.0
    joint_q = simulation.state.hands.joint_q.numpy()
    np.testing.assert_allclose(joint_q[1], joint_q[0], atol=1e-5, err_msg="the focus should not change the physics")


@pytest.mark.parametrize("backend", BACKENDS)
def test_objects_rest_on_a_stage_and_on_each_other(backend: Backend) -> None:
    """One on the stage, one on its lid: both sink by the depth of their contacts, 1 mm, and stay."""
    stage = StageConfig(height=0.2, size=(0.5, 0.4), position=(0.3, 0.0))
    scene = replace(two_boxes(False), stage=stage)
    simulation = backend([scene], [1])
    top = max(part.vertices[:, 2].max() for part in scene.objects[0].parts)
    start(simulation, [[0.3, 0.0, 0.2], [0.3, 0.0, 0.2 + top]], (0.0, 0.0, 3.0))
    for _ in range(50):
        simulation.step(lambda rows: None)
    pose, velocity = simulation.state.slots.pose.numpy()[0], simulation.state.slots.velocity.numpy()[0]
    np.testing.assert_allclose(pose[:, :3], [[0.3, 0.0, 0.2], [0.3, 0.0, 0.2 + top]], atol=2e-3)
    np.testing.assert_allclose(np.abs(pose[:, 6]), 1.0, atol=1e-4)
    assert np.abs(velocity).max() < 0.02
    assert np.abs(simulation.state.slots.hinge_q.numpy()).max() < 0.02


def test_hands_pass_through_a_stage() -> None:
    """As they do through the table."""
    simulation = CpuSimulation([replace(open_scene(True), stage=StageConfig(0.3, (1.0, 1.0)))], [1])
    start(simulation, [[5.0, 0.0, 0.3]], (0.0, 0.0, 0.35))
    torques = press_down(simulation, 20.0)
    for _ in range(30):
        simulation.step(torques)
    assert simulation.state.hands.joint_q.numpy()[0, 0, 2] < -0.3
    assert (simulation.state.diverged.numpy() == 0).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_scenes_that_differ_in_more_than_their_objects_are_refused(backend: Backend) -> None:
    """They would not fit one layout."""
    scene = open_scene(False)
    for other in (two_boxes(False), open_scene(True), replace(scene, stage=StageConfig(0.1, (1.0, 1.0)))):
        with pytest.raises(ValueError, match="scenes: expected them to differ in nothing but their objects"):
            backend([scene, other], [1, 1])
