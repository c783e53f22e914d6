"""Measure how still objects lie on the table and on a stage.

    python tools/measure_rest.py [OBJECT ...]

lets each object (all by default) stand as in its first reference for 5.5 s and prints how far its base drifts from
where it is after 0.5 s [mm], at most: on the table, on a stage, and on a stage with a single contact for each pair of
convex pieces, which shows why there are more. The table of it is in `docs/physics.md`.
"""

import argparse

import mujoco
import numpy as np
import warp as wp

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import load_object
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import PhysicsConfig, StageConfig
from artigrasp.references.reference import load_references
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.scene import Scene

STAGE = StageConfig(height=0.2, size=(0.8, 0.8))
SETTLE_STEPS, REST_STEPS = 50, 500
"""Control steps of 10 ms."""


def drift(names: list[str], stage: StageConfig | None, single_contacts: bool = False) -> Array:
    """Largest distance of each object from where it had settled [m]."""
    hand = load_hand("open", "right")
    scenes = [Scene((hand,), (load_object(name),), False, PhysicsConfig(), stage) for name in names]
    simulation = CpuSimulation(scenes, [1] * len(scenes))
    if single_contacts:
        for model in simulation.models:
            model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MULTICCD.value
    references = [load_references(name) for name in names]
    pose = np.stack([each.object_pose[0] for each in references]).astype(np.float32)
    pose[:, 2] += 0.0 if stage is None else stage.height
    hands, objects = simulation.state.hands, simulation.state.objects
    objects.pose.assign(pose)
    objects.hinge_q.assign(np.array([each.object_angle[0] for each in references], dtype=np.float32))
    hands.hand_base.assign(np.tile(np.array([0, 0, 5, 0, 0, 0, 1], dtype=np.float32), (len(names), 1, 1)))
    simulation.write_state(wp.full(len(names), 1, dtype=int, device="cpu"))
    positions = []
    for _ in range(SETTLE_STEPS + REST_STEPS):
        simulation.step(lambda rows: None)
        positions.append(objects.pose.numpy()[:, :3].astype(np.float64))
    rest = np.stack(positions[SETTLE_STEPS:])
    return np.asarray(np.linalg.norm(rest - rest[0], axis=-1).max(axis=0))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", nargs="*", metavar="OBJECT")
    start_warp()
    names = parser.parse_args().objects or list_assets("references")
    found = [drift(names, None), drift(names, STAGE), drift(names, STAGE, single_contacts=True)]
    print("| object | table | stage | stage, single contacts |\n| --- | --- | --- | --- |")
    for name, *millimetres in zip(names, *(1000 * each for each in found), strict=True):
        print(f"| {name} |", " | ".join(f"{each:.2f}" for each in millimetres), "|")


if __name__ == "__main__":
    main()
