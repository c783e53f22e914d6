"""The state of an environment in the middle of its episodes: all of it, to go on exactly, or one world's instant."""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.environment.environment import Environment
from artigrasp.environment.instant import OBJECT_FIELDS, Instant
from artigrasp.kernels import metrics, states
from artigrasp.kernels.layout import PARTS
from artigrasp.simulation.cpu import CpuSimulation

_GIVEN = ("environment._every_world", "environment._first_reference", "environment._reference_count")
"""Arrays that stay what they were made as."""


def take_snapshot(environment: Environment) -> dict[str, NDArray[Any]]:
    """Copies of everything that has a row for each world, by name."""
    return {name: _rows(array).copy() for name, array in _world_arrays(environment).items()}


def restore_snapshot(environment: Environment, snapshot: dict[str, NDArray[Any]]) -> None:
    """Go back to a snapshot of an environment that was made alike.

    The CPU backend goes on bit for bit; MuJoCo Warp starts its solver anew.

    Raises:
        KeyError, ValueError: It is one of another environment.
    """
    arrays = _world_arrays(environment)
    if arrays.keys() != snapshot.keys():
        raise KeyError(", ".join(sorted(arrays.keys() ^ snapshot.keys())))
    bounds = _index_bounds(environment)
    for name, array in arrays.items():
        expected, found = _rows(array), snapshot[name]
        if found.shape != expected.shape or found.dtype != expected.dtype:
            raise ValueError(
                f"{name}: expected {expected.dtype} of shape {expected.shape}, found {found.dtype} of {found.shape}"
            )
        if name in _GIVEN and not np.array_equal(found, expected):
            raise ValueError(f"{name}: expected that of these objects and references, found another")
        # kernels look up what these point to, and look no further whether it is there
        low, high = bounds.get(name, (0, 0))
        if name in bounds and found.size and not low <= found.min() <= found.max() < high:
            raise ValueError(f"{name}: expected {low} to {high - 1}, found {found.min()} to {found.max()}")
    if not isinstance(environment.simulation, CpuSimulation):
        _assign(arrays, snapshot)
        environment.simulation.write_state(wp.full(environment.world_count, 1, dtype=int, device=environment.device))
    _assign(arrays, snapshot)


def read_instant(environment: Environment, world: int) -> Instant:
    """Where one world of an environment is now."""
    state = environment.state
    holders: dict[str, Any] = dict.fromkeys(("joint_q", "joint_qd", "hand_base"), state.hands)
    holders |= dict.fromkeys(("home", "target", "stiffness", "damping"), environment)
    holders |= dict.fromkeys(OBJECT_FIELDS, state.slots)
    return Instant(**{name: np.array(getattr(holder, name).numpy()[world]) for name, holder in holders.items()})


def _index_bounds(environment: Environment) -> dict[str, tuple[int, int]]:
    """The least index and one more than the largest, by the names of arrays that are indices."""
    references = (0, sum(len(each) for each in (*environment.references, *environment.bystanders)))
    return {
        "goal.part": (0, len(PARTS)),
        "goal.contact_part": (-1, len(PARTS)),
        "phase.index": (0, len(environment.phases)),
        "machine.reference_index": references,
        "machine._references_of_world": references,
        "state.focus": (0, environment.state.object_count),
    }


def batched_arrays(environment: Environment) -> dict[str, wp.array]:
    """Arrays of the structs that kernels read and write, by name."""
    state = environment.state
    groups = {
        "hands": (state.hands, states.HandState),
        "objects": (state.objects, states.ObjectState),
        "slots": (state.slots, states.ObjectSlots),
        "goal": (environment.goal, states.Goal),
        "phase": (environment.phase, states.PhaseState),
        "metrics": (environment.metrics, metrics.EpisodeMetrics),
    }
    return {
        f"{group}.{name}": getattr(values, name)
        for group, (values, kind) in groups.items()
        for name in states.element_types(kind)
    }


def _world_arrays(environment: Environment) -> dict[str, Any]:
    """Arrays of the environment and its simulation with a row for each world, by name."""
    arrays: dict[str, Any] = batched_arrays(environment)
    arrays["simulation.joint_torque"] = environment.simulation.joint_torque
    holders: dict[str, object] = {
        "environment": environment,
        "acting": environment._acting,
        "machine": environment._machine,
        "state": environment.state,
    }
    if isinstance(environment.simulation, CpuSimulation):
        holders["packed"] = environment.simulation.packed
    for holder, values in holders.items():
        for name, value in vars(values).items():
            if isinstance(value, wp.array | np.ndarray) and value.shape[:1] == (environment.world_count,):
                arrays[f"{holder}.{name}"] = value
    return arrays


def _rows(array: Any) -> NDArray[Any]:
    return array if isinstance(array, np.ndarray) else np.asarray(array.numpy())


def _assign(arrays: dict[str, Any], values: dict[str, NDArray[Any]]) -> None:
    for name, array in arrays.items():
        if isinstance(array, np.ndarray):
            array[:] = values[name]
        else:
            array.assign(values[name])
