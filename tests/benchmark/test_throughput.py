"""The benchmark measures what it says and leaves things as they were; no test asks how long anything takes."""

import json
import math
from dataclasses import replace

import mujoco.rollout
import numpy as np
import pytest
import warp as wp

from artigrasp.benchmark.bare_physics import NewtonPhysics, RolloutPhysics, ThreadedLoop, cpu_simulation
from artigrasp.benchmark.kernel_shares import PHYSICS, REST
from artigrasp.benchmark.memory import forget_peak, peak_memory_mb
from artigrasp.benchmark.recorded_states import RecordedStates
from artigrasp.benchmark.throughput import STAGES, Throughput, measure_throughput
from artigrasp.cli import main
from artigrasp.config import SimulatorConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.tasks import get_task
from tests.environment.examples import TWO_THREADS

WORLDS = 4
ALTERNATIVES = [("mj_step", "physics"), ("mjwarp", "physics"), ("mjwarp", "environment")]
OBJECTS = ("lidded-box",)
TASK = replace(get_task("right-fixed"), world_count=WORLDS)


@pytest.fixture(scope="module")
def states() -> RecordedStates:
    """Three states in which hands touch the box."""
    return RecordedStates(TASK, OBJECTS, split="train", count=3, threads=2)


@pytest.fixture(scope="module", params=["cpu", "mjwarp"])
def environment(request: pytest.FixtureRequest) -> Environment:
    """More worlds of the paper's task than were recorded."""
    task = replace(TASK, world_count=WORLDS + 2)
    return make_environment(task, OBJECTS, simulator=SimulatorConfig(request.param, "cpu", 2))


@pytest.fixture(scope="module")
def measured() -> Throughput:
    """A benchmark with few worlds and few steps."""
    return measure_throughput(TASK, OBJECTS, WORLDS, rounds=2, seconds=0.01)


def test_every_stage_is_measured(measured: Throughput) -> None:
    """All stages and alternatives have speeds, and ratios to the physics that lie in the rounds' range."""
    assert tuple(each.stage for each in measured.stages) == STAGES
    assert [(each.backend, each.stage) for each in measured.alternatives] == ALTERNATIVES
    for each in (*measured.stages, *measured.alternatives):
        assert (each.worlds, each.device, each.hands, each.base) == (WORLDS, "cpu", 1, "fixed")
        for value in (each.control_steps_per_s, each.ratio_to_physics, each.peak_memory_mb):
            assert math.isfinite(value) and value > 0
        low, high = measured.ratio_ranges[each.backend, each.stage]
        assert low <= each.ratio_to_physics <= high
    assert measured.stages[0].ratio_to_physics == 1.0 and 0.0 < measured.learn_share < 1.0
    memory = [each.peak_memory_mb for each in measured.stages]
    assert memory == sorted(memory)


def test_mujoco_warp_can_be_what_is_measured() -> None:
    """Its stages relate to its own physics, and nothing else is measured beside it."""
    simulator = SimulatorConfig("mjwarp", "cpu", 1)
    measured = measure_throughput(TASK, OBJECTS, 2, rounds=1, seconds=0.01, simulator=simulator)
    assert [(each.backend, each.stage) for each in measured.stages] == [("mjwarp", stage) for stage in STAGES]
    assert measured.stages[0].ratio_to_physics == 1.0
    assert not measured.alternatives and not measured.shares


def test_shares_make_up_the_whole(measured: Throughput) -> None:
    """MuJoCo, every kernel and the rest add up; a kernel of every substep is called once per block and substep."""
    shares = {each.name: each for each in measured.shares}
    assert math.isclose(sum(each.share for each in measured.shares), 1.0)
    assert {PHYSICS, REST, "pd_torques", "finish_substep", "compute_rewards", "compute_features"} <= set(shares)
    assert shares["pd_torques"].calls == shares[PHYSICS].calls == shares["finish_substep"].calls
    assert shares[PHYSICS].calls % TASK.physics.substeps == 0


def test_measuring_leaves_the_libraries_alone(measured: Throughput) -> None:
    """What was hooked to time launches is as before."""
    for function in (wp.launch, wp.Launch.launch, mujoco.rollout.Rollout.rollout):
        assert function.__name__ != "timed_call"


def test_states_touch_and_come_back(environment: Environment, states: RecordedStates) -> None:
    """Hands touch the object; the same state gives the same control step bit for bit, and others give others.

    Worlds beyond the recorded ones repeat them.
    """
    assert states.touching_links > 0
    restore = states.restorer(environment)
    action = wp.zeros((WORLDS + 2, 1, environment.action_count), dtype=float, device=environment.device)
    results = []
    for index in (0, 1, 2, 3):
        restore(index)
        environment.step(action)
        environment.observe()
        results.append(environment.features.numpy().copy())
    np.testing.assert_array_equal(results[0], results[3])
    np.testing.assert_array_equal(results[0][WORLDS:], results[0][:2])
    assert np.abs(results[1] - results[0]).max() > 0


def test_objects_get_their_own_states(states: RecordedStates) -> None:
    """Worlds repeat what was recorded of the same object, however many there are of each."""
    two = RecordedStates(replace(TASK, world_count=5), OBJECTS * 2, split="train", count=1, threads=2)
    environment = make_environment(replace(TASK, world_count=3), OBJECTS * 2, simulator=TWO_THREADS)
    two.restorer(environment)(0)
    recorded = two._states[0]
    joint_torque = environment.simulation.joint_torque.numpy()
    for world, source in enumerate((0, 1, 3)):
        np.testing.assert_array_equal(joint_torque[world], recorded[1][source])


def test_bare_physics_is_the_physics_with_torques_held(states: RecordedStates) -> None:
    """In one call or in a hand-written loop, it ends where the simulation ends, without changing the simulation."""
    environment = make_environment(TASK, OBJECTS, simulator=TWO_THREADS)
    simulation = cpu_simulation(environment)
    states.restorer(environment)(0)
    packed = simulation.packed
    before = [array.copy() for array in (packed.state, packed.control, packed.sensor)]
    physics, loop = RolloutPhysics(simulation), ThreadedLoop(simulation)
    for each in (physics, loop):
        each.hold_torques()
        each.step()
    for array, kept in zip((packed.state, packed.control, packed.sensor), before, strict=True):
        np.testing.assert_array_equal(array, kept)
    simulation.step(lambda rows: None)
    np.testing.assert_allclose(physics._state[:, -1], packed.state, atol=1e-4)
    looped = np.stack([np.concatenate([[data.time], data.qpos, data.qvel]) for _, data in loop._worlds])
    np.testing.assert_allclose(looped, physics._state[:, -1], atol=1e-9)


def test_bare_mujoco_warp_is_the_physics_with_torques_held(states: RecordedStates) -> None:
    """Launched kernel by kernel or replayed, it ends where the simulation ends."""
    environment = make_environment(TASK, OBJECTS, simulator=SimulatorConfig("mjwarp", "cpu"))
    simulation = environment.simulation
    assert isinstance(simulation, NewtonSimulation)
    restore, physics = states.restorer(environment), NewtonPhysics(simulation)
    ends = []
    for _ in range(3):
        restore(0)
        physics.hold_torques()
        physics.step()
        ends.append(simulation._state.joint_q.numpy().copy())
    restore(0)
    with simulation.without_replay():
        simulation.step(lambda rows: None)
    for end in ends:
        np.testing.assert_array_equal(end, simulation._state.joint_q.numpy())


def test_peak_memory_is_forgotten() -> None:
    """What was held before does not count; what is held does, even if it is given back."""
    forget_peak()
    before = peak_memory_mb("cpu")
    array = np.ones(10_000_000)
    assert peak_memory_mb("cpu") > before + 70
    del array
    assert peak_memory_mb("cpu") > before + 70
    forget_peak()
    assert peak_memory_mb("cpu") < before + 40


def test_command_line_prints_the_agreed_json(capsys: pytest.CaptureFixture[str]) -> None:
    """A list with one entry per number of worlds and stage, fewest worlds first."""
    words = ["--worlds", "2", "1", "--hands", "2", "--bases", "free", "--alternatives", "off"]
    assert main(["bench", *words, "--rounds", "1", "--seconds", "0.01", "--threads", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(each["worlds"], each["stage"]) for each in found] == [(n, stage) for n in (1, 2) for stage in STAGES]
    for each in found:
        assert list(each) == [
            "backend", "device", "hands", "base", "worlds", "stage", "control_steps_per_s", "ratio_to_physics",
            "peak_memory_mb",
        ]  # fmt: skip
        assert (each["backend"], each["device"], each["hands"], each["base"]) == ("cpu", "cpu", 2, "free")


def test_command_line_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    """Machine, scene, stages, alternatives and kernels."""
    words = ["--worlds", "2", "--hands", "1", "--bases", "free", "--rounds", "1", "--seconds", "0.01"]
    assert main(["bench", *words, "--threads", "1"]) == 0
    printed = capsys.readouterr().out
    for text in ("cores:", "mujoco:", "1 hand, free base", *STAGES, PHYSICS, "pd_torques", REST):
        assert text in printed
    for backend, stage in ALTERNATIVES:
        assert f"{backend}, {stage}" in printed and f"times {backend}, {stage} at 2 worlds" in printed


@pytest.mark.parametrize(
    "arguments", [["--worlds", "0"], ["--rounds", "0"], ["--seconds", "0"], ["--threads", "-1"], ["--task", "no-task"]]
)
def test_bad_usage_is_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """One line, exit code 2."""
    assert main(["bench", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("error: ") and captured.err.count("\n") == 1 and not captured.out
