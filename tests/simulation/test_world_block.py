"""Blocks of worlds: how they are cut, that they do not touch each other, and where the solver starts."""

import mujoco
import numpy as np
import pytest
import warp as wp

from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.world_block import split_worlds
from tests.simulation.scenes import open_scene

WORLDS = 7


@pytest.mark.parametrize(
    ("counts", "block_count", "expected"),
    [
        ([8], 4, [(0, 0, 2), (0, 2, 4), (0, 4, 6), (0, 6, 8)]),
        ([5], 2, [(0, 0, 2), (0, 2, 5)]),
        ([1], 4, [(0, 0, 1)]),
        ([4, 0, 2], 3, [(0, 0, 2), (0, 2, 4), (2, 4, 6)]),
        ([1, 1, 1], 2, [(0, 0, 1), (1, 1, 2), (2, 2, 3)]),
    ],
)
def test_worlds_are_shared_out(counts: list[int], block_count: int, expected: list[tuple[int, int, int]]) -> None:
    """Blocks are of one scene, as even as can be, and cover every world once."""
    found = [(scene, rows.start, rows.stop) for scene, rows in split_worlds(counts, block_count)]
    assert found == expected


def pressing(thread_count: int) -> CpuSimulation:
    """Hands that begin a few millimetres apart over the box and are let fall on it."""
    simulation = CpuSimulation([open_scene(True)], [WORLDS], thread_count)
    hands = simulation.state.hands
    base = np.tile(np.array([0.12, 0.0, 0.14, 0.0, 0.0, 0.0, 1.0], dtype=np.float32), (WORLDS, 1, 1))
    base[:, 0, 0] += np.linspace(-0.03, 0.03, WORLDS)
    hands.hand_base.assign(base)
    simulation.state.objects.pose.assign(np.tile(np.array([0, 0, 0, 0, 0, 0, 1], dtype=np.float32), (WORLDS, 1)))
    simulation.write_state(wp.full(WORLDS, 1, dtype=int, device="cpu"))
    return simulation


def press(simulation: CpuSimulation, rows: slice) -> None:
    """Hold the fingers, push the wrist down."""
    hands = simulation.state.hands
    q, qd = hands.joint_q.numpy()[rows], hands.joint_qd.numpy()[rows]
    torque = -20.0 * q - 0.2 * qd
    torque[..., 2] = -8.0
    simulation.joint_torque.numpy()[rows] = np.clip(torque, -10.0, 10.0)


def test_threads_and_blocks_do_not_matter() -> None:
    """Worlds go the same way bit for bit, through contact, however many threads share them out."""
    one, three = pressing(1), pressing(3)
    assert len(one.torque_rows) < len(three.torque_rows)
    for _ in range(40):
        for simulation in (one, three):
            simulation.step(lambda rows, simulation=simulation: press(simulation, rows))
    assert np.linalg.norm(one.state.hands.contact_force.numpy(), axis=-1).max() > 1.0
    for name in ("joint_q", "joint_qd", "contact_force"):
        found = getattr(three.state.hands, name).numpy()
        np.testing.assert_array_equal(getattr(one.state.hands, name).numpy(), found)
        assert np.abs(found - found[:1]).max() > 0, "worlds should differ"
    np.testing.assert_array_equal(one.state.objects.hinge_q.numpy(), three.state.objects.hinge_q.numpy())
    np.testing.assert_array_equal(one.packed.state, three.packed.state)


def test_solver_starts_near_the_last_acceleration() -> None:
    """The guessed warm start is close to the acceleration that MuJoCo ended the substep with."""
    simulation = pressing(1)
    for _ in range(20):
        simulation.step(lambda rows: press(simulation, rows))
    model, packed = simulation.models[0], simulation.packed
    data = mujoco.MjData(model)
    before = packed.state.copy(), packed.warmstart.copy()
    torques = []

    def record(rows: slice) -> None:
        press(simulation, rows)
        torques.append(simulation.joint_torque.numpy()[0, 0].copy())

    simulation.step(record)
    layout_columns = simulation._layout.hand_force.numpy()[0]
    mujoco.mj_setState(model, data, before[0][0], mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
    data.mocap_pos[:] = packed.control[0, model.nv :][: 3 * model.nmocap].reshape(-1, 3)
    data.mocap_quat[:] = packed.control[0, model.nv + 3 * model.nmocap :].reshape(-1, 4)
    data.qacc_warmstart[:] = before[1][0]
    first_block = simulation.torque_rows[0]
    assert first_block.start == 0
    for torque in torques[: simulation.substeps]:
        data.qfrc_applied[layout_columns] = torque
        mujoco.mj_step(model, data)
    error = np.linalg.norm(packed.warmstart[0] - data.qacc_warmstart) / np.linalg.norm(data.qacc_warmstart)
    assert error < 0.2


def test_an_error_in_a_block_comes_out() -> None:
    """What goes wrong in a thread is raised where the step was asked for."""
    simulation = pressing(2)

    def fail(rows: slice) -> None:
        if rows.start > 0:
            raise RuntimeError("no torques")

    with pytest.raises(RuntimeError, match="no torques"):
        simulation.step(fail)
