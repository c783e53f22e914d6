"""Contacts that do not fit in MuJoCo's memory are counted, and the memory that scenes are given."""

import numpy as np
import pytest
import warp as wp

from artigrasp.simulation import mujoco_model
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.mujoco_model import newton_mjcf
from artigrasp.simulation.scene import Scene
from tests.simulation.scenes import open_scene

WORLDS = 4
IN_THE_BOX = (1, 3)


@pytest.fixture
def small_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave MuJoCo room for few contacts."""

    def with_little_memory(scene: Scene) -> str:
        return newton_mjcf(scene).replace("<worldbody>", '<size memory="60K"/><worldbody>', 1)

    monkeypatch.setattr(mujoco_model, "newton_mjcf", with_little_memory)


def stuck(simulation: CpuSimulation) -> None:
    """Hands far away, but for those of some worlds, which are stuck in the box."""
    base = np.zeros((WORLDS, 1, 7), dtype=np.float32)
    base[..., 2], base[..., 6] = 2.0, 1.0
    base[IN_THE_BOX, 0, 2] = 0.1
    simulation.state.hands.hand_base.assign(base)
    simulation.state.objects.pose.assign(np.tile(np.float32([0, 0, 0, 0, 0, 0, 1]), (WORLDS, 1)))
    simulation.write_state(wp.full(WORLDS, 1, dtype=int, device="cpu"))


@pytest.mark.usefixtures("small_memory")
def test_dropped_contacts_are_counted() -> None:
    """In the worlds that they happen in, and in every substep, though all worlds share one ``MjData``."""
    simulation = CpuSimulation([open_scene(True)], [WORLDS], thread_count=2)
    stuck(simulation)
    simulation.step(lambda rows: None)
    counts = simulation.state.overflow_count.numpy()
    assert (counts[list(IN_THE_BOX)] > 0).all() and counts.max() <= simulation.substeps
    assert not counts[[0, 2]].any() and not simulation.state.diverged.numpy().any()


def test_there_is_room_in_the_scenes_own_memory() -> None:
    """The same worlds fit in the memory that a scene is compiled with."""
    simulation = CpuSimulation([open_scene(True)], [WORLDS], thread_count=2)
    stuck(simulation)
    simulation.step(lambda rows: None)
    assert not simulation.state.overflow_count.numpy().any()
