"""The state of an environment in the middle of its episodes: all of it, to go on exactly, or one world's instant."""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.environment.environment import Environment
from artigrasp.environment.instant import OBJECT_FIELDS, Instant
from artigrasp.kernels import metrics, states
from artigrasp.simulation.cpu import CpuSimulation


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
    for name, array in arrays.items():
        if _rows(array).shape != snapshot[name].shape:
            raise ValueError(f"{name}: expected the shape {_rows(array).shape}, found {snapshot[name].shape}")
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


def _world_arrays(environment: Environment) -> dict[str, Any]:
    """Arrays of the environment and its simulation with a row for each world, by name."""
    state = environment.state
    groups = {
        "hands": (state.hands, states.HandState),
        "objects": (state.objects, states.ObjectState),
        "slots": (state.slots, states.ObjectSlots),
        "goal": (environment.goal, states.Goal),
        "phase": (environment.phase, states.PhaseState),
        "metrics": (environment.metrics, metrics.EpisodeMetrics),
    }
    arrays: dict[str, Any] = {
        f"{group}.{name}": getattr(values, name)
        for group, (values, kind) in groups.items()
        for name in states.element_types(kind)
    }
    arrays["simulation.joint_torque"] = environment.simulation.joint_torque
    holders: dict[str, object] = {
        "environment": environment,
        "acting": environment._acting,
        "machine": environment._machine,
        "state": state,
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
