"""The physics of a control step and nothing else, torques held: what every stage is compared with, and alternatives."""

from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import mujoco
import numpy as np
import warp as wp
from mujoco.rollout import Rollout

from artigrasp.environment.environment import Environment
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.simulation.world_block import CONTROL


class BarePhysics(Protocol):
    """Steps the worlds of a simulation from their present state without changing what the simulation tells of it."""

    def hold_torques(self) -> None:
        """Take the simulation's present state and the torques that it was given last for the next step."""

    def step(self) -> None:
        """One control step."""


def bare_physics(environment: Environment) -> BarePhysics:
    """That of an environment's backend."""
    if isinstance(environment.simulation, NewtonSimulation):
        return NewtonPhysics(environment.simulation)
    return RolloutPhysics(cpu_simulation(environment))


class RolloutPhysics:
    """All substeps of a control step in one call of MuJoCo's `rollout` per scene.

    It has the simulation's models and as many threads, but writes to arrays of its own: the simulation does not change.
    """

    def __init__(self, simulation: CpuSimulation) -> None:
        """Allocate what a call reads and writes."""
        self._simulation = simulation
        packed, step_shape = simulation.packed, (simulation.world_count, simulation.substeps)
        self._control = np.empty((*step_shape, packed.control.shape[1]))
        self._state = np.empty((*step_shape, packed.state.shape[1]))
        self._sensor = np.empty((*step_shape, packed.sensor.shape[1]))
        self._rollout = Rollout(nthread=simulation.thread_count)
        self._scenes = [
            ([model] * (rows.stop - rows.start), [mujoco.MjData(model) for _ in range(simulation.thread_count)], rows)
            for model, rows in zip(simulation.models, simulation.scene_rows, strict=True)
        ]

    def hold_torques(self) -> None:
        """Take the torques that MuJoCo was given last for every substep of the next step."""
        self._control[:] = self._simulation.packed.control[:, None]

    def step(self) -> None:
        """One control step from the simulation's present state."""
        packed = self._simulation.packed
        for models, data, rows in self._scenes:
            self._rollout.rollout(
                models,
                data,
                packed.state[rows],
                self._control[rows],
                control_spec=CONTROL,
                skip_checks=True,
                nstep=self._simulation.substeps,
                initial_warmstart=packed.warmstart[rows],
                state=self._state[rows],
                sensordata=self._sensor[rows],
            )


class ThreadedLoop:
    """`mj_step` in a pool of threads, as one would write it by hand: each thread has its share of the worlds."""

    def __init__(self, simulation: CpuSimulation) -> None:
        """Make one MjData per world."""
        self._simulation = simulation
        models = [
            model
            for model, rows in zip(simulation.models, simulation.scene_rows, strict=True)
            for _ in range(rows.start, rows.stop)
        ]
        self._worlds = [(model, mujoco.MjData(model)) for model in models]
        self._shares = [self._worlds[first :: simulation.thread_count] for first in range(simulation.thread_count)]
        self._pool = ThreadPoolExecutor(simulation.thread_count)

    def hold_torques(self) -> None:
        """Give every MjData the simulation's present state and torques."""
        packed = self._simulation.packed
        for (model, data), state, control, warmstart in zip(
            self._worlds, packed.state, packed.control, packed.warmstart, strict=True
        ):
            mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
            mujoco.mj_setState(model, data, control, CONTROL)
            data.qacc_warmstart[:] = warmstart

    def step(self) -> None:
        """One control step."""
        list(self._pool.map(self._step_share, self._shares))

    def _step_share(self, worlds: list[tuple[mujoco.MjModel, mujoco.MjData]]) -> None:
        for model, data in worlds:
            mujoco.mj_step(model, data, self._simulation.substeps)


class NewtonPhysics:
    """All substeps of a control step by Newton's MuJoCo Warp solver, replayed from a graph: no forces are read back."""

    def __init__(self, simulation: NewtonSimulation) -> None:
        """Nothing is recorded yet."""
        self._simulation = simulation
        self._graph: wp.Graph | None = None
        self._step_count = 0

    def hold_torques(self) -> None:
        """Write the simulation's torques where the solver takes them from."""
        self._simulation.pack_torques()

    def step(self) -> None:
        """One control step; the second is recorded, as kernels must be loaded before they can be."""
        self._step_count += 1
        if self._step_count == 1:
            self._simulation.step_solver()
            return
        if self._graph is None:
            with wp.ScopedCapture(device=self._simulation.device) as recording:
                self._simulation.step_solver()
            self._graph = recording.graph
        wp.capture_launch(self._graph)


def cpu_simulation(environment: Environment) -> CpuSimulation:
    """The CPU backend of an environment.

    Raises:
        TypeError: It has another backend.
    """
    if not isinstance(environment.simulation, CpuSimulation):
        raise TypeError(f"expected the CPU backend, found {type(environment.simulation).__name__}")
    return environment.simulation
