"""The physics of a control step and nothing else: what every stage is compared with."""

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from artigrasp.environment.environment import Environment
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.world_block import CONTROL


class BarePhysics:
    """All substeps of a control step in one call of MuJoCo's `rollout` per scene, with torques held.

    It steps the worlds of a simulation with the simulation's models and as many threads, but writes to arrays of its
    own: the simulation does not change.
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


def cpu_simulation(environment: Environment) -> CpuSimulation:
    """The CPU backend of an environment.

    Raises:
        TypeError: It has another backend.
    """
    if not isinstance(environment.simulation, CpuSimulation):
        raise TypeError(f"expected the CPU backend, found {type(environment.simulation).__name__}")
    return environment.simulation
