"""Hold gradients of the differentiable rollout against finite differences, step by step of its horizon.

    python tools/check_rollout_gradients.py [--object NAME] [--hand NAME] [--reference I] [--steps T ...]

A right hand stands at an articulation reference of the split ``train``, on an object whose base is fixed, and is told
to lift its wrist by 5 cm. Printed for every number of control steps:

* free: the relative error of the gradient of the height of the index fingertip, the hand being far from the object;
* in contact: the same of the hinge angle, the hand being at its reference, the median of the relative errors of the
  components, the cosine between the two gradients, and the angle itself.

A gradient has as many components as there are probed PD targets and initial rates: the wrist's six and the flexion of
every finger, each held for the whole horizon, and the rate of the hinge. Differences are central.
"""

import argparse

import numpy as np
import warp as wp

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import PhysicsConfig
from artigrasp.kernels.layout import DOFS, KEYPOINTS, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import pose_parts_in_base
from artigrasp.references.poses import compose_poses, invert_poses
from artigrasp.references.quality import wrist_in_base
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.simulation.differentiable import DifferentiableRollout
from artigrasp.simulation.scene import Scene

RIGHT = 1
LIFT = 0.05
"""How far the wrist should rise [m]."""
AWAY = 1.0
"""Distance from the object at which nothing touches [m]."""
FREE_STEP = 0.02
"""Of the differences in free motion, where everything is nearly linear [m, rad]."""
TARGETS = [*range(WRIST_DOF_COUNT), *(DOFS.index(f"{finger}1_rz") for finger in ("index", "middle", "ring", "thumb"))]
"""The PD targets that are probed."""


def prepare(
    scene: Scene, reference: ReferenceSet, worlds: int, steps: int, away: float, timestep: float
) -> DifferentiableRollout:
    """Worlds in which the hand is at the reference, or away from it along x, with the targets of the lift."""
    rollout = DifferentiableRollout(scene, worlds, steps, timestep=timestep)
    wrist = wrist_in_base(reference, pose_parts_in_base(scene.objects[0], reference.object_angle))[:, RIGHT:]
    base = compose_poses(reference.object_pose[:, None], wrist)
    base[..., 0] += away
    rollout.place(np.repeat(base, worlds, axis=0), np.repeat(reference.object_pose[:, None], worlds, axis=0))
    joint_q = np.zeros(rollout.joint_q.shape, np.float32)
    joint_q[..., WRIST_DOF_COUNT:] = reference.finger_angles[0, RIGHT]
    rollout.joint_q.assign(joint_q)
    rollout.hinge_q.fill_(float(reference.object_angle[0]))
    upwards = np.array([[0, 0, LIFT, 0, 0, 0, 1.0]])
    turn = base[0] * [0, 0, 0, 1, 1, 1, 1]
    joint_q[..., :3] = compose_poses(invert_poses(turn), upwards)[0, :3]
    for target in rollout.targets:
        target.assign(joint_q)
    return rollout


def output(rollout: DifferentiableRollout, step: int, free: bool) -> Array:
    """The fingertip's height at the end, or the hinge angle after a step, of every world."""
    if free:
        return np.asarray(rollout.hands.keypoint.numpy()[:, 0, KEYPOINTS.index("index_tip"), 2], np.float64)
    return np.asarray(rollout.hinge_angles[step].numpy()[:, 0], np.float64)


def differences(rollout: DifferentiableRollout, step: int, size: float, free: bool) -> Array:
    """Central differences by every probed input; worlds come in pairs."""
    return (output(rollout, step, free)[0::2] - output(rollout, step, free)[1::2]) / (2 * size)


def disturb(rollout: DifferentiableRollout, size: float, free: bool) -> None:
    """In each pair of worlds, shift one input up and down by so much."""
    for target in rollout.targets:
        values = target.numpy().copy()
        for pair, dof in enumerate(TARGETS):
            values[2 * pair, 0, dof] += size
            values[2 * pair + 1, 0, dof] -= size
        target.assign(values)
    if not free:
        rates = rollout.hinge_qd.numpy().copy()
        rates[-2:, 0] = [size, -size]
        rollout.hinge_qd.assign(rates)


def gradient(rollout: DifferentiableRollout, step: int, free: bool) -> Array:
    """The same by the tape, of a rollout with one world."""
    if free:
        seed = np.zeros((*rollout.hands.keypoint.shape, 3), np.float32)
        seed[0, 0, KEYPOINTS.index("index_tip"), 2] = 1.0
        rollout.backward({rollout.hands.keypoint: wp.array(seed, dtype=wp.vec3)})
    else:
        rollout.backward({rollout.hinge_angles[step]: wp.full((1, 1), 1.0, dtype=float)})
    by_target = np.sum([target.grad.numpy()[0, 0, TARGETS] for target in rollout.targets], axis=0)
    return by_target if free else np.append(by_target, rollout.hinge_qd.grad.numpy()[0, 0])


def compare(found: np.ndarray, expected: np.ndarray) -> tuple[float, float, float]:
    """Relative error, the median of those of the components, and the cosine."""
    norms = np.linalg.norm(found), np.linalg.norm(expected)
    error = np.linalg.norm(found - expected) / norms[1]
    of_components = np.median(np.abs(found - expected) / np.maximum(np.abs(expected), 1e-9))
    return float(error), float(of_components), float(found @ expected / norms[0] / norms[1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Hold gradients of the rollout against finite differences.")
    parser.add_argument("--object", default="lidded-box")
    parser.add_argument("--hand", default="open")
    parser.add_argument("--reference", type=int, default=0)
    parser.add_argument("--steps", type=int, nargs="+", default=[1, 2, 3, 5, 8, 12])
    parser.add_argument("--timestep", type=float, default=5e-4)
    parser.add_argument("--difference", type=float, default=1e-3, help="step of the differences in contact [m, rad]")
    arguments = parser.parse_args()
    scene = Scene((load_hand(arguments.hand, "right"),), (load_object(arguments.object),), True, PhysicsConfig())
    reference = load_references(arguments.object).select(split="train", kind="articulate", indices=arguments.reference)
    longest = max(arguments.steps)

    pairs = len(TARGETS) + 1
    disturbed = prepare(scene, reference, 2 * pairs, longest, 0.0, arguments.timestep)
    disturb(disturbed, arguments.difference, free=False)
    disturbed.run()
    one = prepare(scene, reference, 1, longest, 0.0, arguments.timestep)
    one.run()
    print(
        "control steps | free: error | in contact: error | median of components | cosine | hinge angle [rad]",
        flush=True,
    )
    for step in arguments.steps:
        expected = differences(disturbed, step, arguments.difference, free=False)
        error, median, cosine = compare(gradient(one, step, free=False), expected)
        free = check_free(scene, reference, step, arguments.timestep)
        angle = output(one, step, free=False)[0]
        print(f"{step} | {free:.4f} | {error:.4f} | {median:.4f} | {cosine:.4f} | {angle:.4f}", flush=True)
    print(f"{one.contact_count()} pairs of shapes near each other at the end, {one.substeps} substeps per control step")


def check_free(scene: Scene, reference: ReferenceSet, step: int, timestep: float) -> float:
    """Relative error of the fingertip's gradient far from the object."""
    disturbed = prepare(scene, reference, 2 * len(TARGETS), step, AWAY, timestep)
    disturb(disturbed, FREE_STEP, free=True)
    disturbed.run()
    one = prepare(scene, reference, 1, step, AWAY, timestep)
    one.run()
    return compare(gradient(one, step, free=True), differences(disturbed, step, FREE_STEP, free=True))[0]


if __name__ == "__main__":
    main()
