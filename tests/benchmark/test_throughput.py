"""The benchmark measures what it says and leaves things as they were; no test asks how long anything takes."""

import json
import math
from dataclasses import replace

import mujoco.rollout
import numpy as np
import pytest
import warp as wp

from artigrasp.benchmark.bare_physics import BarePhysics, cpu_simulation
from artigrasp.benchmark.kernel_shares import PHYSICS, REST
from artigrasp.benchmark.recorded_states import RecordedStates
from artigrasp.benchmark.throughput import STAGES, Throughput, measure_throughput
from artigrasp.cli import main
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.tasks import TASKS, get_task
from tests.environment.examples import TWO_THREADS

WORLDS = 4
OBJECTS = ("lidded-box",)
TASK = replace(get_task("right-fixed"), world_count=WORLDS)


@pytest.fixture(scope="module")
def environment() -> Environment:
    """A few worlds of the paper's task."""
    environment = make_environment(TASK, OBJECTS, simulator=TWO_THREADS)
    environment.reset()
    return environment


@pytest.fixture(scope="module")
def states(environment: Environment) -> RecordedStates:
    """Three states in which hands touch the box."""
    return RecordedStates(environment, OBJECTS, "train", 3)


@pytest.fixture(scope="module")
def measured() -> Throughput:
    """A benchmark with few worlds and few steps."""
    return measure_throughput(replace(TASK, ppo=replace(TASK.ppo, steps_per_env=4)), OBJECTS, WORLDS, rounds=2)


def test_every_stage_is_measured(measured: Throughput) -> None:
    """All stages have speeds, and ratios to the physics that lie in the rounds' range."""
    assert tuple(each.stage for each in measured.stages) == STAGES
    for each in measured.stages:
        assert each.worlds == WORLDS
        for value in (each.control_steps_per_s, each.ratio_to_physics, each.peak_memory_mb):
            assert math.isfinite(value) and value > 0
        low, high = measured.ratio_ranges[each.stage]
        assert low <= each.ratio_to_physics <= high
    assert measured.stages[0].ratio_to_physics == 1.0
    memory = [each.peak_memory_mb for each in measured.stages]
    assert memory == sorted(memory)


def test_shares_make_up_the_whole(measured: Throughput) -> None:
    """MuJoCo, every kernel and the rest add up; a kernel of every substep is called once per block and substep."""
    shares = {each.name: each for each in measured.shares}
    assert math.isclose(sum(each.share for each in measured.shares), 1.0)
    assert {PHYSICS, REST, "pd_torques", "finish_substep", "compute_rewards", "compute_features"} <= set(shares)
    assert shares["compute_rewards"].calls == 1
    assert shares["pd_torques"].calls == shares[PHYSICS].calls == shares["finish_substep"].calls
    assert shares[PHYSICS].calls % TASK.physics.substeps == 0


def test_measuring_leaves_the_libraries_alone(measured: Throughput) -> None:
    """What was hooked to time launches is as before."""
    for function in (wp.launch, wp.Launch.launch, mujoco.rollout.Rollout.rollout):
        assert function.__name__ != "timed_call"


def test_states_touch_and_come_back(environment: Environment, states: RecordedStates) -> None:
    """Hands touch the object; the same state gives the same control step bit for bit, and others give others."""
    assert states.touching_links > 0
    action = wp.zeros((WORLDS, 1, environment.action_count), dtype=float, device=environment.device)
    results = []
    for index in (0, 1, 2, 3):
        states.restore(index)
        environment.step(action)
        environment.observe()
        results.append(environment.features.numpy().copy())
    np.testing.assert_array_equal(results[0], results[3])
    assert np.abs(results[1] - results[0]).max() > 0


def test_bare_physics_is_the_physics_with_torques_held(environment: Environment, states: RecordedStates) -> None:
    """It ends where the simulation ends with torques held, without changing the simulation."""
    simulation = cpu_simulation(environment)
    physics = BarePhysics(simulation)
    states.restore(0)
    before = [array.copy() for array in (simulation.packed.state, simulation.packed.control, simulation.packed.sensor)]
    physics.hold_torques()
    physics.step()
    for array, kept in zip(
        (simulation.packed.state, simulation.packed.control, simulation.packed.sensor), before, strict=True
    ):
        np.testing.assert_array_equal(array, kept)
    simulation.step(lambda rows: None)
    np.testing.assert_allclose(physics._state[:, -1], simulation.packed.state, atol=1e-4)


def test_command_line_prints_the_agreed_json(capsys: pytest.CaptureFixture[str]) -> None:
    """A list with one entry per number of worlds and stage, fewest worlds first."""
    assert main(["bench", "--worlds", "2", "1", "--rounds", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(each["worlds"], each["stage"]) for each in found] == [(n, stage) for n in (1, 2) for stage in STAGES]
    for each in found:
        assert list(each) == [
            "backend", "device", "hands", "base", "worlds", "stage", "control_steps_per_s", "ratio_to_physics",
            "peak_memory_mb",
        ]  # fmt: skip
        assert (each["backend"], each["device"], each["hands"], each["base"]) == ("cpu", "cpu", 1, "fixed")


def test_command_line_prints_a_table(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine, stages and kernels."""
    monkeypatch.setitem(TASKS, "quick", replace(TASK, ppo=replace(TASK.ppo, steps_per_env=2)))
    assert main(["bench", "--task", "quick", "--worlds", "2", "--rounds", "1", "--threads", "1"]) == 0
    printed = capsys.readouterr().out
    for text in ("cores:", "mujoco:", "1 thread of physics", *STAGES, PHYSICS, "pd_torques", REST):
        assert text in printed


@pytest.mark.parametrize(
    "arguments", [["--worlds", "0"], ["--rounds", "0"], ["--threads", "-1"], ["--task", "no-task"]]
)
def test_bad_usage_is_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """One line, exit code 2."""
    assert main(["bench", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("error: ") and captured.err.count("\n") == 1 and not captured.out
