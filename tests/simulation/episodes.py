"""Episodes of the zero controller, recorded so that any backend can repeat pieces of them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config import SimulatorConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.backend import Simulation
from artigrasp.simulation.state import SimulationState
from artigrasp.tasks import get_task
from tests.example_references import RIGHT, box_references
from tests.kernels.samples import mirror_poses

LEFT = 1 - RIGHT
GOAL_ANGLE = 1.0
BEHIND = np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0])
"""A second box whose lid touches the back of the first."""

HAND_ARRAYS = ("joint_q", "joint_qd", "hand_base")
OBJECT_ARRAYS = ("pose", "velocity", "hinge_q", "hinge_qd")


@dataclass(frozen=True)
class Recording:
    """One world's episode."""

    state: dict[str, NDArray[np.float32]]
    """Each array before every control step, shape [step, ...]."""
    torque: NDArray[np.float32]
    """Joint torques of every substep, shape [step, substep, hand, 51]."""
    touched: NDArray[np.bool_]
    """Whether a hand touched the object, shape [step]."""


@dataclass(frozen=True)
class Setting:
    """What an episode takes place with."""

    sides: tuple[str, ...]
    fixed_base: bool
    has_bystander: bool = False
    """Whether a second box stands right behind the first."""


def lid_opening(setting: Setting, backend: str) -> Environment:
    """One world in which the hands hook their fingers under the box's lid and follow the hinge."""
    sides = setting.sides
    references = box_references().select(indices=[0])
    if len(sides) == 2:
        references = _with_left_hand(references)
    task = replace(get_task("right-fixed-synergy"), hands=sides, fixed_base=setting.fixed_base)
    environment = Environment(
        task,
        [references],
        trial_worlds([references], [GOAL_ANGLE]),
        bystanders=[references] if setting.has_bystander else [],
        noise=False,
        simulator=SimulatorConfig(backend, "cpu"),
    )
    if setting.has_bystander:
        environment.place_bystander(1, BEHIND)
    return environment


def _with_left_hand(references: ReferenceSet, distance: float = 0.05) -> ReferenceSet:
    """The left hand as the mirror of the right one, both moved to their side so that the palms stay apart [m]."""
    wrist, fingers, contacts = (
        getattr(references, name).copy() for name in ("wrist_pose_in_part", "finger_angles", "contacts")
    )
    wrist[:, RIGHT, 0] += distance
    wrist[:, LEFT] = mirror_poses(wrist[:, RIGHT])
    # turns about y and z change their sense in the mirror
    fingers[:, LEFT] = fingers[:, RIGHT] * np.tile(np.array([1, -1, -1], dtype=np.float32), 15)
    contacts[:, LEFT] = contacts[:, RIGHT]
    part = np.repeat(references.part[:, [RIGHT]], 2, axis=1)
    return replace(
        references,
        active=np.ones_like(references.active),
        part=part,
        wrist_pose_in_part=wrist,
        finger_angles=fingers,
        contacts=contacts,
    )


def play(environment: Environment) -> Array:
    """Run one episode with actions of zero; the hinge angle after every control step [rad], shape [step]."""
    environment.reset()
    shape = (environment.world_count, environment.hand_count, environment.action_count)
    action = wp.zeros(shape, dtype=float, device=environment.device)
    angles = []
    for _ in range(environment.task.episode_steps):
        environment.step(action)
        angles.append(float(environment.state.objects.hinge_q.numpy()[0]))
    return np.array(angles)


def record(environment: Environment) -> tuple[Recording, Array]:
    """The episode that :meth:`play` runs, and its angles."""
    simulation, step = environment.simulation, environment.simulation.step
    states: list[dict[str, NDArray[np.float32]]] = []
    torques: list[NDArray[np.float32]] = []
    touched: list[bool] = []

    def recorded_step(apply_torques, *begin_and_finish):  # type: ignore[no-untyped-def]
        def recorded_torques(rows: slice) -> None:
            apply_torques(rows)
            torques.append(simulation.joint_torque.numpy()[0].copy())

        states.append({name: array.numpy()[0].copy() for name, array in state_arrays(simulation.state).items()})
        step(recorded_torques, *begin_and_finish)
        touched.append(bool(simulation.state.hands.contact_force.numpy().any()))

    simulation.step = recorded_step  # type: ignore[method-assign]
    angles = play(environment)
    return (
        Recording(
            state={name: np.stack([each[name] for each in states]) for name in states[0]},
            torque=np.stack(torques).reshape(len(states), simulation.substeps, *torques[0].shape),
            touched=np.array(touched),
        ),
        angles,
    )


def state_arrays(state: SimulationState) -> dict[str, wp.array]:
    """The arrays that a simulation is started from."""
    hands = {name: getattr(state.hands, name) for name in HAND_ARRAYS}
    return hands | {name: getattr(state.slots, name) for name in OBJECT_ARRAYS}


def replay(
    simulation: Simulation, recording: Recording, starts: NDArray[np.int64], step_count: int
) -> Iterator[dict[str, NDArray[np.float32]]]:
    """Start each world at another step of a recording and repeat the torques from there.

    Yields:
        State and contact forces of all worlds after every control step, by name.
    """
    for name, array in state_arrays(simulation.state).items():
        array.assign(recording.state[name][starts])
    simulation.state.read_focus()
    simulation.write_state(wp.full(len(starts), 1, dtype=int, device=simulation.device))
    for step in range(step_count):
        substep = dict.fromkeys((rows.start for rows in simulation.torque_rows), 0)

        def apply_torques(rows: slice, step: int = step, substep: dict[int, int] = substep) -> None:
            simulation.joint_torque[rows].assign(recording.torque[starts[rows] + step, substep[rows.start]])
            substep[rows.start] += 1

        simulation.step(apply_torques)
        arrays = state_arrays(simulation.state) | {"contact_force": simulation.state.hands.contact_force}
        yield {name: array.numpy().copy() for name, array in arrays.items()}
