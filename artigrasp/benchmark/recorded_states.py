"""States in which hands and objects touch, recorded once and put back before every measurement."""

from collections.abc import Sequence

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.benchmark.bare_physics import cpu_simulation
from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.environment.environment import Environment
from artigrasp.environment.make import make_environment
from artigrasp.kernels import metrics, states

APPROACH_STEPS = 120
"""Control steps after which the PD+IK hand has arrived, closed and begun to pull."""


class RecordedStates:
    """Successive control steps of the PD+IK baseline, as states of an environment of any action space.

    A state is everything that a control step reads: MuJoCo's own vectors with the solver's start, the batched arrays,
    goals, metrics and clocks. The torques that come with it are those of the last substep after one control step in
    which the environment's own prior acted.

    Attributes:
        touching_links: Links that touch the object, mean over states, worlds and hands.
    """

    def __init__(self, environment: Environment, objects: Sequence[str], split: str, count: int) -> None:
        """Let PD+IK play in a copy of the environment.

        Args:
            environment: The environment to be measured, with the CPU backend.
            objects: Its objects.
            split: Split of its references.
            count: States to record, one per control step.
        """
        self._arrays = _arrays(environment)
        task = pd_ik_controller(environment.task).task
        simulator = SimulatorConfig(threads=cpu_simulation(environment).thread_count)
        played = make_environment(task, objects, split=split, seed=environment.seed, simulator=simulator)
        no_action = wp.zeros((played.world_count, played.hand_count, 1), dtype=float, device=played.device)
        played.reset()
        for _ in range(APPROACH_STEPS):
            played.step(no_action)
        self._states: list[list[NDArray[np.generic]]] = []
        touching = []
        for _ in range(count):
            self._states.append([array.copy() for array in _arrays(played)])
            touching.append(
                (np.linalg.norm(played.state.hands.contact_force.numpy(), axis=-1).max(axis=-1) > 0).sum(-1)
            )
            played.step(no_action)
        self.touching_links = float(np.mean(touching))
        self._take_torques(environment)

    def __len__(self) -> int:
        return len(self._states)

    def restore(self, index: int) -> None:
        """Put the environment into a state, counted round and round."""
        for array, recorded in zip(self._arrays, self._states[index % len(self._states)], strict=True):
            array[...] = recorded

    def _take_torques(self, environment: Environment) -> None:
        """Replace PD+IK's targets and torques by those of the environment's own prior."""
        shape = (environment.world_count, environment.hand_count, environment.action_count)
        no_action = wp.zeros(shape, dtype=float, device=environment.device)
        targets_and_torques = len(_commands(environment))
        for index, state in enumerate(self._states):
            self.restore(index)
            environment.step(no_action)
            state[:targets_and_torques] = [array.copy() for array in _commands(environment)]


def _arrays(environment: Environment) -> list[NDArray[np.generic]]:
    """Views of everything that a control step reads, targets and torques first."""
    groups = (
        (states.HandState, environment.state.hands),
        (states.ObjectState, environment.state.objects),
        (states.Goal, environment.goal),
        (states.PhaseState, environment.phase),
        (metrics.EpisodeMetrics, environment.metrics),
    )
    arrays = [getattr(group, name) for kind, group in groups for name in states.element_types(kind)]
    arrays += [environment.step_count, environment.reference_index]
    arrays += [environment.state.diverged, environment.state.overflow_count]
    packed = cpu_simulation(environment).packed
    return [*_commands(environment), packed.state, packed.warmstart, *(array.numpy() for array in arrays)]


def _commands(environment: Environment) -> list[NDArray[np.generic]]:
    simulation = cpu_simulation(environment)
    return [environment.target.numpy(), simulation.joint_torque.numpy(), simulation.packed.control]
