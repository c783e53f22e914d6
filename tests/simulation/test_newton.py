"""The Newton backend on the CPU device: replays, resets, failures, capacities, and objects that differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from artigrasp.assets.object import load_object
from artigrasp.assets.object_model import Mesh, ObjectModel, PartModel
from artigrasp.assets.object_usd import write_object
from artigrasp.errors import UserError
from artigrasp.kernels.torques import pd_torques
from artigrasp.simulation.backend import Simulation, make_simulation
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.newton import NewtonSimulation
from tests.simulation.episodes import state_arrays
from tests.simulation.scenes import open_scene

WORLDS = 3


class PressingHand:
    """PD torques that press the hand on the lid: kernels only, so that they can be recorded."""

    def __init__(self, simulation: Simulation) -> None:
        shape = simulation.joint_torque.shape
        target = np.zeros(shape, dtype=np.float32)
        target[..., 2] = -0.1
        device, hands = simulation.device, simulation.state.hands
        gains = [wp.full((*shape[:2], 3), gain, dtype=float, device=device) for gain in (50.0, 0.2)]
        effort = wp.full(shape[1:], 2.0, dtype=float, device=device)
        self._shape, self._device = shape[:2], device
        self._inputs = [wp.array(target, dtype=float, device=device), hands.joint_q, hands.joint_qd, *gains, effort]
        self._torque = simulation.joint_torque

    def apply(self, rows: slice) -> None:
        """Fill the torques of all worlds."""
        wp.launch(pd_torques, self._shape, inputs=self._inputs, outputs=[self._torque], device=self._device)


def over_the_lid(simulation: Simulation) -> None:
    """Start every world with open hands close over the lid, each world's a little higher, and the lid ajar."""
    objects = [scene.objects[0] for scene in simulation.scenes]
    tops = np.repeat([each.parts[1].vertices[:, 2].max() for each in objects], simulation.world_count // len(objects))
    base = np.zeros((simulation.world_count, 1, 7), dtype=np.float32)
    base[:, 0, 0], base[:, 0, 6] = 0.1, 1.0
    base[:, 0, 2] = tops + 0.06 + 0.005 * np.arange(simulation.world_count)
    pose = np.zeros((simulation.world_count, 7), dtype=np.float32)
    pose[:, 6] = 1.0
    for name, array in state_arrays(simulation.state).items():
        array.assign(base if name == "hand_base" else pose if name == "pose" else np.zeros_like(array.numpy()))
    simulation.state.objects.hinge_q.fill_(0.05)
    simulation.state.diverged.zero_()
    simulation.write_state(everyone(simulation))


def press(simulation: Simulation, step_count: int) -> list[dict[str, np.ndarray]]:
    """What happens after :func:`over_the_lid`, control step by control step."""
    torques = PressingHand(simulation)
    over_the_lid(simulation)
    trace = []
    for _ in range(step_count):
        simulation.step(torques.apply)
        trace.append(everything(simulation))
    return trace


def everyone(simulation: Simulation) -> wp.array:
    """The mask of all worlds."""
    return wp.full(simulation.world_count, 1, dtype=int, device=simulation.device)


def everything(simulation: Simulation) -> dict[str, np.ndarray]:
    """Copies of the state and the contact forces."""
    arrays = state_arrays(simulation.state) | {"contact_force": simulation.state.hands.contact_force}
    return {name: array.numpy().copy() for name, array in arrays.items()}


@pytest.fixture(scope="module")
def simulation() -> NewtonSimulation:
    """Worlds that replay what they recorded."""
    return NewtonSimulation([open_scene(True)], [WORLDS])


@pytest.fixture(scope="module")
def pressing(simulation: NewtonSimulation) -> PressingHand:
    """Its torques, which must stay the same for the recording to stay valid."""
    return PressingHand(simulation)


def test_a_replay_is_the_step_it_recorded(simulation: NewtonSimulation, pressing: PressingHand) -> None:
    """Bit for bit the same as without recording, resets in between included."""
    eager = NewtonSimulation([open_scene(True)], [WORLDS], capture=False)
    mask = wp.array([0, 1, 0], dtype=int, device="cpu")
    for each, torques in ((eager, PressingHand(eager)), (simulation, pressing)):
        over_the_lid(each)
        for step in range(30):
            if step == 20:
                each.state.hands.joint_q.fill_(0.1)
                each.state.objects.hinge_q.zero_()
                each.write_state(mask)
            each.step(torques.apply)
    found, expected = everything(simulation), everything(eager)
    assert expected["contact_force"].any(), "the hands should press on the lid"
    for name, array in expected.items():
        np.testing.assert_array_equal(found[name], array, err_msg=name)


def test_ways_to_step_take_turns(simulation: NewtonSimulation, pressing: PressingHand) -> None:
    """Each is recorded once, however often another is used in between."""

    def nothing(rows: slice) -> None:
        pass

    ways = [(pressing.apply,), (nothing,), (nothing, pressing.apply, nothing)]
    over_the_lid(simulation)
    for _ in range(2):
        for way in ways:
            simulation.step(*way)
    recorded = dict(simulation._graphs)
    assert len(set(map(id, recorded.values()))) == len(recorded) >= len(ways) and None not in recorded.values()
    for way in ways:
        simulation.step(*way)
    assert simulation._graphs == recorded


def test_writing_some_worlds_leaves_the_others_alone(simulation: NewtonSimulation, pressing: PressingHand) -> None:
    """A masked write resets just its worlds; a world written back to its start does again what it did."""
    over_the_lid(simulation)
    start = everything(simulation)
    trace = []
    for _ in range(20):
        simulation.step(pressing.apply)
        trace.append(everything(simulation))
    over_the_lid(simulation)
    for _ in range(10):
        simulation.step(pressing.apply)
    for name, array in state_arrays(simulation.state).items():
        array[1:2].assign(start[name][1:2])
    simulation.write_state(wp.array([0, 1, 0], dtype=int, device="cpu"))
    for _ in range(10):
        simulation.step(pressing.apply)
    found = everything(simulation)
    for name, array in found.items():
        np.testing.assert_array_equal(array[[0, 2]], trace[19][name][[0, 2]], err_msg=name)
        np.testing.assert_array_equal(array[1], trace[9][name][1], err_msg=name)


def test_failed_physics_is_marked_and_spreads_to_nobody(simulation: NewtonSimulation, pressing: PressingHand) -> None:
    """A world that is no longer finite is marked and starts from zero; its neighbours do not notice."""
    over_the_lid(simulation)
    for _ in range(5):
        simulation.step(pressing.apply)
    expected = everything(simulation)
    over_the_lid(simulation)
    speed = simulation.state.hands.joint_qd.numpy().copy()
    speed[1, 0, 7] = np.nan
    simulation.state.hands.joint_qd.assign(speed)
    simulation.write_state(everyone(simulation))
    for _ in range(5):
        simulation.step(pressing.apply)
    found = everything(simulation)
    assert simulation.state.diverged.numpy().tolist() == [0, 1, 0]
    for name, array in found.items():
        assert np.isfinite(array).all(), name
        np.testing.assert_array_equal(array[[0, 2]], expected[name][[0, 2]], err_msg=name)


def test_dropped_contacts_are_counted() -> None:
    """A substep with more contacts than there is room for counts, in its world."""
    simulation = NewtonSimulation([open_scene(True)], [1], contact_capacity=4)
    over_the_lid(simulation)
    simulation.step(lambda rows: None)
    assert simulation.state.overflow_count.numpy().tolist() == [0]
    base = np.zeros((1, 1, 7), dtype=np.float32)
    base[..., 2], base[..., 6] = 0.1, 1.0  # the hand stuck in the box
    simulation.state.hands.hand_base.assign(base)
    simulation.write_state(everyone(simulation))
    simulation.step(lambda rows: None)
    assert 0 < simulation.state.overflow_count.numpy()[0] <= simulation.substeps


def test_unknown_backends_and_devices_are_refused() -> None:
    """A backend or device that is not there is the user's to mend."""
    scene = open_scene(True)
    with pytest.raises(UserError, match="did you mean 'mjwarp'"):
        make_simulation("mjwrap", [scene], [1])
    with pytest.raises(UserError, match=r"device: expected one of .*cpu.*, found 'cuda:99'"):
        make_simulation("mjwarp", [scene], [1], device="cuda:99")
    with pytest.raises(UserError, match="device: expected cpu for the backend cpu"):
        make_simulation("cpu", [scene], [1], device="cuda:0")


def scaled(model: ObjectModel, factor: float, path: Path) -> ObjectModel:
    """A copy of another size with a piece less, at the same density."""

    def mesh(old: Mesh) -> Mesh:
        return Mesh(old.vertices * factor, old.faces)

    def part(old: PartModel, pieces: tuple[Mesh, ...]) -> PartModel:
        return replace(
            old,
            mass=old.mass * factor**3,
            com=old.com * factor,
            inertia=old.inertia * factor**5,
            vertices=old.vertices * factor,
            pieces=tuple(mesh(piece) for piece in pieces),
        )

    base, articulated = model.parts
    copy = replace(
        model,
        path=path,
        parts=(part(base, base.pieces[:-1]), part(articulated, articulated.pieces)),
        hinge_origin=model.hinge_origin * factor,
    )
    write_object(copy)
    return copy


def test_worlds_may_hold_different_objects(tmp_path: Path) -> None:
    """Objects of other size, mass, hinge and number of pieces, side by side, behave as each does in a model of its own.

    Hands press on lids of different height, so that every quantity that differs matters.
    """
    scene = open_scene(True)
    small = scaled(load_object("lidded-box"), 0.8, tmp_path / "small.usda")
    scenes = [scene, replace(scene, objects=(small,))]
    found, expected = (
        press(simulation, 40)
        for simulation in (NewtonSimulation(scenes, [2, 2]), CpuSimulation(scenes, [2, 2], thread_count=1))
    )
    for step, (ours, theirs) in enumerate(zip(found, expected, strict=True)):
        for name, tolerance in {"joint_q": 1e-5, "hinge_q": 1e-5, "contact_force": 1e-2}.items():
            np.testing.assert_allclose(ours[name], theirs[name], atol=tolerance, err_msg=f"{name} after step {step}")
    pressure = np.linalg.norm(found[-1]["contact_force"], axis=-1).sum(axis=(1, 2, 3))
    assert (pressure > 1.0).all()
    assert np.ptp(found[-1]["hinge_q"][[0, 2]]) > 1e-3, "the same finger presses the two lids in by different angles"
