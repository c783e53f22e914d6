"""Open objects on the table: they rest closed and open, and nothing holds their hinge back."""

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, object_name
from artigrasp.assets.open_set.parameters import FIRST_UNSEEN_SEED
from artigrasp.config import PhysicsConfig
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.scene import Scene

NAMES = [object_name(category, seed) for category in CATEGORIES for seed in (0, FIRST_UNSEEN_SEED)]


@pytest.fixture(scope="module")
def simulation() -> CpuSimulation:
    """Two worlds of each canonical object and of a variant, free on the table, a hand far above."""
    hand = load_hand("open", "right")
    scenes = [Scene((hand,), (load_object(name),), False, PhysicsConfig()) for name in NAMES]
    return CpuSimulation(scenes, [2] * len(scenes))


def upper(simulation: CpuSimulation) -> Array:
    """Largest hinge angle of every world [rad]."""
    return np.repeat([scene.objects[0].hinge_upper for scene in simulation.scenes], 2)


def place(simulation: CpuSimulation, angles: Array) -> None:
    """Put the objects upright on the table, at hinge angles [rad]."""
    count = simulation.world_count
    hands, objects = simulation.state.hands, simulation.state.objects
    hands.hand_base.assign(np.tile(np.array([0, 0, 5, 0, 0, 0, 1], dtype=np.float32), (count, 1, 1)))
    objects.pose.assign(np.tile(np.array([0, 0, 0, 0, 0, 0, 1], dtype=np.float32), (count, 1)))
    objects.velocity.zero_()
    objects.hinge_q.assign(angles.astype(np.float32))
    objects.hinge_qd.zero_()
    simulation.write_state(wp.full(count, 1, dtype=int, device="cpu"))


def names(wrong: NDArray[np.bool_]) -> list[str]:
    """The objects of some worlds."""
    return [f"{name}, {state}" for name, pair in zip(NAMES, wrong.reshape(-1, 2), strict=True)
            for state, each in zip(("closed", "open"), pair, strict=True) if each]  # fmt: skip


def test_objects_rest_closed_and_open(simulation: CpuSimulation) -> None:
    """Upright, shut or at their stop, objects move by less than a millimetre and a hundredth of a radian in 2 s."""
    stop = upper(simulation) * np.tile([0.0, 1.0], len(NAMES))
    place(simulation, stop)
    objects = simulation.state.objects
    for _ in range(50):
        simulation.step(lambda rows: None)
    settled, angle = objects.pose.numpy().copy(), objects.hinge_q.numpy().copy()
    for _ in range(200):
        simulation.step(lambda rows: None)
    pose = objects.pose.numpy()
    turn = (Rotation.from_quat(pose[:, 3:]) * Rotation.from_quat(settled[:, 3:]).inv()).magnitude()
    upright = Rotation.from_quat(pose[:, 3:]).apply([0.0, 0.0, 1.0])[:, 2]
    moved = np.linalg.norm(pose[:, :3] - settled[:, :3], axis=1)
    still = (moved < 1e-3) & (turn < 0.01) & (np.abs(objects.hinge_q.numpy() - angle) < 0.01) & (upright > 0.999)
    assert still.all(), names(~still)
    assert (np.abs(angle - stop) < 0.05).all(), names(np.abs(angle - stop) >= 0.05)


def test_hinges_turn_through_their_range(simulation: CpuSimulation) -> None:
    """Turned at 3 rad/s from the middle, every part reaches either end of its range: not even the table stops it."""
    most = upper(simulation)
    speed = np.tile(np.array([-3.0, 3.0], dtype=np.float32), len(NAMES))
    place(simulation, 0.5 * most)
    objects = simulation.state.objects
    reached = np.zeros(len(most), bool)
    for _ in range(70):
        objects.hinge_qd.assign(speed)
        simulation.write_state(wp.full(len(most), 1, dtype=int, device="cpu"))
        simulation.step(lambda rows: None)
        angle = objects.hinge_q.numpy()
        reached |= np.where(speed < 0, angle < 0.03, angle > most - 0.03)
    assert reached.all(), names(~reached)
