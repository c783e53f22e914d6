"""Measure how many contacts and constraint rows two hands and a free object need, object by object.

    python tools/measure_capacities.py [OBJECT ...] [--references N] [--seed S] [--newton]

plays N references (24 by default, spread over all there are) of each object (all by default) in three ways for 300
control steps: the hands close to the reference and lift with it (`grasp`), close half a radian further (`squeeze`), or
get random targets every tenth of a second (`random`). It prints the most contacts and constraint rows that any world
had at the end of a control step, counted by MuJoCo. With `--newton` the ten fullest states of each object go through
MuJoCo Warp on the CPU device too, whose contacts and pairs of shapes that might touch share one capacity. The sizes
in `artigrasp.simulation.newton` come from this table, see `docs/physics.md`.
"""

import argparse
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.assets.library import list_assets
from artigrasp.benchmark.bare_physics import cpu_simulation
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import ActionConfig, ResidualConfig, SynergyConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.kernels.states import ObjectSlots, element_types
from artigrasp.references.reference import load_references
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.simulation.scene import Scene
from artigrasp.tasks import get_task

STEPS = 300
FULLEST = 10
ROOM = 4000
"""Contacts and rows for which MuJoCo Warp gets room here: more than are found."""
FLEXION = 6
"""Column of the common finger flexion in a synergy action."""

CLOSE = ActionConfig(wrist_prior="hinge", finger_prior="reference", synergy=None, residual=None, approach_steps=60)
RANDOM = ResidualConfig(wrist_translation=0.05, wrist_rotation=0.3, fingers=0.5, decision_interval=10)
WAYS = {
    "grasp": CLOSE,
    "squeeze": replace(CLOSE, synergy=SynergyConfig(finger_flexion=0.5, decision_interval=STEPS)),
    "random": replace(CLOSE, residual=RANDOM),
}


@dataclass(frozen=True)
class Sample:
    """One world at the end of a control step."""

    contacts: int
    rows: int
    state: dict[str, NDArray[np.float32]]
    """What a simulation is started from."""


def task(action: ActionConfig) -> TaskConfig:
    """Two hands and a free object, any kind of reference."""
    return replace(
        get_task("right-fixed"), hands=("left", "right"), fixed_base=False, kinds=("articulate", "grasp"), action=action
    )


def play(name: str, way: str, reference_count: int, seed: int) -> tuple[Scene, list[Sample]]:
    """The fullest states of an object's episodes, the fullest first, and the scene."""
    every = load_references(name)
    chosen = np.unique(np.linspace(0, len(every) - 1, reference_count).astype(int))
    references = [every.select(indices=chosen)]
    environment = Environment(task(WAYS[way]), references, trial_worlds(references, [1.0]), seed=seed)
    simulation = cpu_simulation(environment)
    data = mujoco.MjData(simulation.models[0])
    environment.reset()
    rng = np.random.default_rng(seed)
    fullest: list[Sample] = []
    for _ in range(STEPS):
        action = np.zeros((environment.world_count, 2, environment.action_count), dtype=np.float32)
        if way == "random":
            action[:] = rng.normal(size=action.shape)
        elif way == "squeeze":
            action[..., FLEXION] = 1.0
        environment.step(wp.array(action, dtype=float, device="cpu"))
        counts = [count(simulation, data, world) for world in range(environment.world_count)]
        world = max(range(environment.world_count), key=lambda world: counts[world])
        fullest.append(Sample(*counts[world], snapshot(simulation, world)))
    return simulation.scenes[0], sorted(fullest, key=lambda sample: sample.contacts, reverse=True)


def count(simulation: CpuSimulation, data: mujoco.MjData, world: int) -> tuple[int, int]:
    """Contacts and constraint rows of a world as it is."""
    model, packed = simulation.models[0], simulation.packed
    mujoco.mj_setState(model, data, packed.state[world], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mocap = packed.control[world, model.nv :]
    data.mocap_pos[:] = mocap[: 3 * model.nmocap].reshape(-1, 3)
    data.mocap_quat[:] = mocap[3 * model.nmocap :].reshape(-1, 4)
    mujoco.mj_fwdPosition(model, data)
    return int(data.ncon), int(data.nefc)


def snapshot(simulation: CpuSimulation, world: int) -> dict[str, NDArray[np.float32]]:
    """Copies of the arrays that a simulation is started from."""
    arrays = {name: getattr(simulation.state.hands, name) for name in ("joint_q", "joint_qd", "hand_base")}
    arrays |= {name: getattr(simulation.state.slots, name) for name in element_types(ObjectSlots)}
    return {name: array.numpy()[[world]].copy() for name, array in arrays.items()}


def newton_counts(simulation: NewtonSimulation, sample: Sample) -> tuple[int, int, int, bool]:
    """Pairs that might touch, contacts, rows, and whether anything overflowed, in the substeps after a sample."""
    for group in (simulation.state.hands, simulation.state.slots):
        for name, values in sample.state.items():
            if hasattr(group, name):
                getattr(group, name).assign(values)
    simulation.state.overflow_count.zero_()
    simulation.write_state(wp.full(1, 1, dtype=int, device="cpu"))
    simulation.step(lambda rows: None)
    data = simulation._solver.mjw_data
    pairs, contacts, rows = (int(array.numpy()[0]) for array in (data.ncollision, data.nacon, data.nefc))
    return pairs, contacts, rows, bool(simulation.state.overflow_count.numpy()[0])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", nargs="*", metavar="OBJECT")
    parser.add_argument("--references", type=int, default=24)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--newton", action="store_true")
    options = parser.parse_args()
    start_warp()
    heads = [f"{way} contacts / rows" for way in WAYS]
    heads += ["MuJoCo Warp: pairs / contacts / rows"] if options.newton else []
    print("| object |", " | ".join(heads), "|")
    print("| --- " * (1 + len(heads)) + "|")
    for name in options.objects or list_assets("references"):
        cells, samples = [], []
        for way in WAYS:
            scene, found = play(name, way, options.references, options.seed)
            cells.append(f"{max(each.contacts for each in found)} / {max(each.rows for each in found)}")
            samples += found
        if options.newton:
            simulation = NewtonSimulation([scene], [1], contact_capacity=ROOM, constraint_capacity=ROOM, capture=False)
            samples.sort(key=lambda sample: sample.contacts, reverse=True)
            counts = [newton_counts(simulation, each) for each in samples[:FULLEST]]
            *peaks, overflow = np.max(counts, axis=0).tolist()
            cells.append(" / ".join(map(str, peaks)) + (" (overflow)" if overflow else ""))
        print(f"| {name} |", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    main()
