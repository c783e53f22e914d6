"""A scene as a MuJoCo model: Newton's own compilation plus the contact sensors that Newton leaves out."""

import contextlib
import io
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from artigrasp.errors import UserError
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.simulation.scene import HAND_BASE, Scene, build_newton_model, make_newton_solver, object_label


@dataclass(frozen=True)
class ModelLayout:
    """Where the scene's quantities stand in MuJoCo's state, control and sensor vectors.

    It depends only on the number of hands and objects and the kind of base, so that worlds with different objects share
    it.
    """

    hand_qpos: NDArray[np.int32]
    """Index of each hand coordinate in qpos, shape [hand, 51]."""
    hand_dof: NDArray[np.int32]
    """Index of each hand coordinate in qvel, shape [hand, 51]."""
    hand_mocap: NDArray[np.int32]
    """Mocap body of each hand's base, shape [hand]."""
    hinge_qpos: NDArray[np.int32]
    """Index of each object's hinge in qpos, shape [object]."""
    hinge_dof: NDArray[np.int32]
    """Index of each object's hinge in qvel, shape [object]."""
    object_qpos: NDArray[np.int32]
    """First of the 7 coordinates of each free base, -1 for fixed ones, shape [object]."""
    object_dof: NDArray[np.int32]
    """First of the 6 velocities of each free base, -1 for fixed ones, shape [object]."""
    object_mocap: NDArray[np.int32]
    """Mocap body of each fixed base, -1 for free ones, shape [object]."""
    contact_sensor: NDArray[np.int32]
    """First of the three force components, shape [object, hand, link, part]."""
    qpos_count: int
    dof_count: int
    mocap_count: int


def compile_mujoco(scene: Scene) -> mujoco.MjModel:
    """Compile a scene through Newton into a MuJoCo model with one net-contact-force sensor per link and object part.

    Newton's compiled model carries no sensors, so its MJCF is read back, completed and compiled again.

    Raises:
        UserError: MuJoCo refuses what an asset says, such as an inertia that no body has.
    """
    try:
        return _compile(scene)
    except ValueError as error:
        if not str(error).startswith("Error: "):  # which MuJoCo's own begin with
            raise
        paths = [*(hand.path for hand in scene.hands), *(each.path for each in scene.objects)]
        assets = ", ".join(map(str, paths))
        raise UserError(
            f"{assets}: cannot be simulated: {str(error).removeprefix('Error: ')}; artigrasp check-asset says more"
        ) from error


def _compile(scene: Scene) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(newton_mjcf(scene))
    spec.option.timestep = scene.physics.timestep
    # fingers do not share joints: a sixth faster with one hand, for which MuJoCo's own choice would be dense matrices
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    for hand in scene.hands:
        for link in LINKS:
            for joint in spec.body(f"{hand.side}_{link}").joints:
                joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
            for part in part_bodies(scene):
                sensor = spec.add_sensor(
                    name=f"{hand.side}_{link}_{part}",
                    type=mujoco.mjtSensor.mjSENS_CONTACT,
                    objtype=mujoco.mjtObj.mjOBJ_BODY,
                    # the force acts on the second body, which is ours
                    objname=part,
                    reftype=mujoco.mjtObj.mjOBJ_BODY,
                    refname=f"{hand.side}_{link}",
                )
                sensor.intprm = [1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, _NET_FORCE, 1]
    return spec.compile()


_NET_FORCE = 3
"""MuJoCo's ``reduce="netforce"``: one slot with the summed force in the world frame."""


def part_bodies(scene: Scene) -> list[str]:
    """Names of the bodies of all parts, object by object."""
    return [f"{object_label(slot)}_{part}" for slot in range(len(scene.objects)) for part in PARTS]


def newton_mjcf(scene: Scene) -> str:
    """The MJCF text that Newton's MuJoCo solver compiles for one world of the scene."""
    model = build_newton_model(scene)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.xml"
        with contextlib.redirect_stdout(io.StringIO()):  # Newton prints where it wrote
            make_newton_solver(scene, model, use_mujoco_cpu=True, save_to_mjcf=str(path))
        return path.read_text(encoding="utf-8")


def model_layout(model: mujoco.MjModel, scene: Scene) -> ModelLayout:
    """Find the scene's quantities in a compiled model."""
    sides = [hand.side for hand in scene.hands]
    joints = [
        [f"{side}_wrist_joint_{kind}{axis}" for kind in ("lin", "ang") for axis in range(3)]
        + [f"{side}_{link}_joint_ang{axis}" for link in LINKS[1:] for axis in range(3)]
        for side in sides
    ]
    sensors = [[[f"{side}_{link}_{part}" for part in part_bodies(scene)] for link in LINKS] for side in sides]
    contact_sensor = _indices(sensors, lambda name: model.sensor(name).adr[0])
    labels = [object_label(slot) for slot in range(len(scene.objects))]
    bases = [model.body(f"{label}_{PARTS[0]}") for label in labels]
    # the joint of a free base; without one, MuJoCo's -1
    base_joints = [int(base.jntadr[0]) for base in bases]
    return ModelLayout(
        hand_qpos=_indices(joints, lambda name: model.joint(name).qposadr[0]),
        hand_dof=_indices(joints, lambda name: model.joint(name).dofadr[0]),
        hand_mocap=_indices(sides, lambda side: model.body(f"{side}_{HAND_BASE}").mocapid[0]),
        hinge_qpos=_indices(labels, lambda label: model.joint(f"{label}_hinge").qposadr[0]),
        hinge_dof=_indices(labels, lambda label: model.joint(f"{label}_hinge").dofadr[0]),
        object_qpos=_indices(base_joints, lambda joint: model.jnt_qposadr[joint] if joint >= 0 else -1),
        object_dof=_indices(base_joints, lambda joint: model.jnt_dofadr[joint] if joint >= 0 else -1),
        object_mocap=_indices(bases, lambda base: base.mocapid[0]),
        contact_sensor=np.moveaxis(contact_sensor.reshape(*contact_sensor.shape[:2], len(labels), -1), 2, 0),
        qpos_count=model.nq,
        dof_count=model.nv,
        mocap_count=model.nmocap,
    )


def _indices(names: Sequence[Any], find: Callable[[Any], int]) -> NDArray[np.int32]:
    """What ``find`` answers to every entry of a nested list."""
    found: NDArray[np.int32] = np.vectorize(find, otypes=[np.int32])(np.array(names, dtype=object))
    return found
