"""States in which hands and objects touch, recorded once and put back before every measurement."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.benchmark.bare_physics import cpu_simulation
from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.environment.snapshot import batched_arrays

APPROACH_STEPS = 120
"""Control steps after which the PD+IK hand has arrived, closed and begun to pull."""

WORLD_LIMIT = 64
"""Worlds that are recorded; more worlds repeat them."""


class RecordedStates:
    """Successive control steps of the PD+IK baseline, as states of environments of any action space.

    A state is everything that a control step reads: the batched arrays, goals, metrics and clocks, and for the CPU
    backend MuJoCo's own vectors with the solver's start. The torques that come with it are those of the last substep
    after one control step in which the task's own prior acted.

    Attributes:
        touching_links: Links that touch the object, mean over states, worlds and hands.
    """

    def __init__(
        self,
        task: TaskConfig,
        objects: Sequence[str],
        *,
        split: str,
        seed: int = 0,
        count: int,
        threads: int | None = None,
    ) -> None:
        """Let PD+IK play.

        Args:
            task: The task to be measured.
            objects: Its objects.
            split: Split of its references.
            seed: Seed of references, goals and noise.
            count: States to record, one per control step.
            threads: Threads of the physics.
        """
        task = replace(task, world_count=max(min(task.world_count, WORLD_LIMIT), len(objects)))
        played, prior = (
            make_environment(each, objects, split=split, seed=seed, simulator=SimulatorConfig(threads=threads))
            for each in (pd_ik_controller(task).task, task)
        )
        self._object_index = played.worlds.object_index
        no_action = wp.zeros((played.world_count, played.hand_count, 0), dtype=float, device=played.device)
        played.reset()
        for _ in range(APPROACH_STEPS):
            played.step(no_action)
        self._states: list[list[NDArray[np.generic]]] = []
        touching = []
        for _ in range(count):
            self._states.append([array.copy() for array in _views(played)])
            force = played.state.hands.contact_force.numpy()
            touching.append((np.linalg.norm(force, axis=-1).max(axis=-1) > 0).sum(-1))
            played.step(no_action)
        self.touching_links = float(np.mean(touching))
        self._take_commands(prior)

    def __len__(self) -> int:
        return len(self._states)

    def restorer(self, environment: Environment) -> Callable[[int], None]:
        """What puts an environment of the recorded objects into a state, counted round and round."""
        source = np.empty(environment.world_count, dtype=int)
        for index in np.unique(self._object_index):
            recorded, wanted = (
                np.flatnonzero(each == index) for each in (self._object_index, environment.worlds.object_index)
            )
            source[wanted] = np.resize(recorded, len(wanted))
        arrays = _arrays(environment)
        every_world = wp.full(environment.world_count, 1, dtype=int, device=environment.device)
        on_cpu = environment.simulator.backend == "cpu"
        packed = _packed(environment) if on_cpu else []

        def restore(index: int) -> None:
            state = self._states[index % len(self._states)]
            for array, values in zip(arrays, state, strict=False):
                array.assign(values[source])
            if on_cpu:
                for view, values in zip(packed, state[len(arrays) :], strict=True):
                    view[...] = values[source]
            else:
                environment.simulation.write_state(every_world)

        return restore

    def _take_commands(self, prior: Environment) -> None:
        """Replace PD+IK's targets and torques by those of the task's own prior."""
        shape = (prior.world_count, prior.hand_count, prior.action_count)
        no_action = wp.zeros(shape, dtype=float, device=prior.device)
        commands = [0, 1, len(_arrays(prior))]
        restore, views = self.restorer(prior), _views(prior)
        for index, state in enumerate(self._states):
            restore(index)
            prior.step(no_action)
            for place in commands:
                state[place] = views[place].copy()


def _arrays(environment: Environment) -> list[wp.array]:
    """The arrays that a control step reads, targets and torques first; those of every backend."""
    state, arrays = environment.state, list(batched_arrays(environment).values())
    arrays += [environment.step_count, environment.reference_index, environment.stiffness, environment.damping]
    arrays += [state.diverged, state.overflow_count]
    return [environment.target, environment.simulation.joint_torque, *arrays]


def _packed(environment: Environment) -> list[Array]:
    """MuJoCo's own vectors, the torques first."""
    packed = cpu_simulation(environment).packed
    return [packed.control, packed.state, packed.warmstart]


def _views(environment: Environment) -> list[NDArray[np.generic]]:
    """All of it in the CPU's memory, which it shares with the environment's."""
    return [*(array.numpy() for array in _arrays(environment)), *_packed(environment)]
