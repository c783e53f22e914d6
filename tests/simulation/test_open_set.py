"""Open objects on the table: they rest closed and open, and nothing holds their hinge back."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import ObjectModel, write_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, make_open_object
from artigrasp.config import PhysicsConfig
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.scene import Scene

SEEDS = (0, 1, 1000)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> list[ObjectModel]:
    """Canonical objects and variants of every category."""
    folder = tmp_path_factory.mktemp("objects")
    made = [
        make_open_object(category, seed, folder / f"{category}-{seed}.usda")
        for category in CATEGORIES
        for seed in SEEDS
    ]
    for model in made:
        write_object(model)
    return made


def start(models: list[ObjectModel], angles: list[float], speeds: list[float]) -> CpuSimulation:
    """Objects on the table at hinge angles [rad] and speeds [rad/s], far from any hand."""
    hand = load_hand("open", "right")
    scenes = [Scene((hand,), (model,), False, PhysicsConfig()) for model in models]
    simulation = CpuSimulation(scenes, [1] * len(scenes))
    hands, objects = simulation.state.hands, simulation.state.objects
    hands.hand_base.assign(np.tile(np.array([0, 0, 5, 0, 0, 0, 1], dtype=np.float32), (len(models), 1, 1)))
    objects.pose.assign(np.tile(np.array([0, 0, 0, 0, 0, 0, 1], dtype=np.float32), (len(models), 1)))
    objects.hinge_q.assign(np.array(angles, dtype=np.float32))
    objects.hinge_qd.assign(np.array(speeds, dtype=np.float32))
    simulation.write_state(wp.full(len(models), 1, dtype=int, device="cpu"))
    return simulation


@pytest.mark.parametrize("opening", [0.0, 1.0], ids=["closed", "open"])
def test_objects_rest(models: list[ObjectModel], opening: float) -> None:
    """From where they stand, upright, objects move by less than a millimetre and a hundredth of a radian in 2 s."""
    simulation = start(models, [opening * model.hinge_upper for model in models], [0.0] * len(models))
    objects = simulation.state.objects
    for step in range(250):
        simulation.step(lambda rows: None)
        if step == 50:
            settled, angle = objects.pose.numpy().copy(), objects.hinge_q.numpy().copy()
    pose = objects.pose.numpy()
    turn = (Rotation.from_quat(pose[:, 3:]) * Rotation.from_quat(settled[:, 3:]).inv()).magnitude()
    upright = Rotation.from_quat(pose[:, 3:]).apply([0.0, 0.0, 1.0])[:, 2]
    names = np.array([model.name for model in models])
    moved = np.linalg.norm(pose[:, :3] - settled[:, :3], axis=1)
    still = (moved < 1e-3) & (turn < 0.01) & (np.abs(objects.hinge_q.numpy() - angle) < 0.01) & (upright > 0.999)
    assert still.all(), names[~still]
    at_stop = np.abs(angle - [opening * model.hinge_upper for model in models]) < 0.05
    assert at_stop.all(), names[~at_stop]


def test_hinges_turn_through_their_range(models: list[ObjectModel]) -> None:
    """Given a push from the middle, every part reaches either end of its range."""
    for sign in (-1.0, 1.0):
        simulation = start(models, [0.5 * model.hinge_upper for model in models], [sign * 12.0] * len(models))
        least = most = simulation.state.objects.hinge_q.numpy()
        for _ in range(60):
            simulation.step(lambda rows: None)
            angle = simulation.state.objects.hinge_q.numpy()
            least, most = np.minimum(least, angle), np.maximum(most, angle)
        reached = least < 0.05 if sign < 0 else most > np.array([model.hinge_upper for model in models]) - 0.05
        assert reached.all(), [model.name for model, there in zip(models, reached, strict=True) if not there]
