"""A scene as a MuJoCo model: Newton's own compilation plus the contact sensors that Newton leaves out."""

import contextlib
import io
import tempfile
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT, LINKS, PARTS
from artigrasp.simulation.scene import HAND_BASE, Scene, build_newton_model, make_newton_solver


@dataclass(frozen=True)
class ModelLayout:
    """Where the scene's quantities stand in MuJoCo's state, control and sensor vectors.

    It depends only on the number of hands and the kind of base, so that worlds with different objects share it.
    """

    hand_qpos: NDArray[np.int32]
    """Index of each hand coordinate in qpos, shape [hand, 51]."""
    hand_dof: NDArray[np.int32]
    """Index of each hand coordinate in qvel, shape [hand, 51]."""
    hinge_qpos: int
    hinge_dof: int
    object_qpos: int
    """First of the 7 coordinates of a free base, -1 for a fixed one."""
    object_dof: int
    hand_mocap: tuple[int, ...]
    object_mocap: int
    """Mocap body of a fixed base, -1 for a free one."""
    contact_sensor: NDArray[np.int32]
    """First of the three force components, shape [hand, link, part]."""
    qpos_count: int
    dof_count: int
    mocap_count: int
    sensor_count: int


def compile_mujoco(scene: Scene) -> mujoco.MjModel:
    """Compile a scene through Newton into a MuJoCo model with one net-contact-force sensor per link and part.

    Newton's compiled model carries no sensors, so its MJCF is read back, completed and compiled again.
    """
    spec = mujoco.MjSpec.from_string(newton_mjcf(scene))
    spec.option.timestep = scene.physics.timestep
    # fingers do not share joints: a sixth faster with one hand, for which MuJoCo's own choice would be dense matrices
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    for hand in scene.hands:
        for link in LINKS:
            for joint in spec.body(f"{hand.side}_{link}").joints:
                joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
            for part in PARTS:
                sensor = spec.add_sensor(
                    name=f"{hand.side}_{link}_{part}",
                    type=mujoco.mjtSensor.mjSENS_CONTACT,
                    objtype=mujoco.mjtObj.mjOBJ_BODY,
                    # the force acts on the second body, which is ours
                    objname=f"object_{part}",
                    reftype=mujoco.mjtObj.mjOBJ_BODY,
                    refname=f"{hand.side}_{link}",
                )
                sensor.intprm = [1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, _NET_FORCE, 1]
    return spec.compile()


_NET_FORCE = 3
"""MuJoCo's ``reduce="netforce"``: one slot with the summed force in the world frame."""


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
    hand_qpos = np.empty((len(sides), DOF_COUNT), dtype=np.int32)
    hand_dof = np.empty_like(hand_qpos)
    contact_sensor = np.empty((len(sides), LINK_COUNT, len(PARTS)), dtype=np.int32)
    for row, side in enumerate(sides):
        names = [f"{side}_wrist_joint_{kind}{axis}" for kind in ("lin", "ang") for axis in range(3)]
        names += [f"{side}_{link}_joint_ang{axis}" for link in LINKS[1:] for axis in range(3)]
        hand_qpos[row] = [model.joint(name).qposadr[0] for name in names]
        hand_dof[row] = [model.joint(name).dofadr[0] for name in names]
        for link, name in enumerate(LINKS):
            for part, part_name in enumerate(PARTS):
                contact_sensor[row, link, part] = model.sensor(f"{side}_{name}_{part_name}").adr[0]
    hinge = model.joint("object_hinge")
    base = model.body("object_base")
    free = base.jntnum[0] == 1
    return ModelLayout(
        hand_qpos=hand_qpos,
        hand_dof=hand_dof,
        hinge_qpos=int(hinge.qposadr[0]),
        hinge_dof=int(hinge.dofadr[0]),
        object_qpos=int(model.jnt_qposadr[base.jntadr[0]]) if free else -1,
        object_dof=int(model.jnt_dofadr[base.jntadr[0]]) if free else -1,
        hand_mocap=tuple(int(model.body(f"{side}_{HAND_BASE}").mocapid[0]) for side in sides),
        object_mocap=-1 if free else int(base.mocapid[0]),
        contact_sensor=contact_sensor,
        qpos_count=model.nq,
        dof_count=model.nv,
        mocap_count=model.nmocap,
        sensor_count=model.nsensordata,
    )
