"""The exported animation against the simulator that the motion came from."""

from pathlib import Path

import mujoco
import numpy as np
from pxr import Usd, UsdGeom

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import PhysicsConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.export.usd import export_usd
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.motion.file import load_motion, save_motion
from artigrasp.motion.generate import generate
from artigrasp.references.reference import load_references
from artigrasp.simulation.mujoco_model import compile_mujoco, model_layout
from artigrasp.simulation.scene import Scene
from artigrasp.tasks import get_task


def test_prims_are_where_mujoco_has_the_bodies(tmp_path: Path) -> None:
    """Simulate, save, load, export: at every sample each prim stands on MuJoCo's body to 1e-4 m, in 1e-4 rad."""
    reference = load_references("lidded-box").select(split="test", indices=0)
    save_motion(tmp_path / "motion.npz", generate(pd_ik_controller(get_task("right-fixed")), reference, 1.0))
    motion = load_motion(tmp_path / "motion.npz")
    export_usd(motion, tmp_path / "motion.usdc", hands="links")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))

    scene = Scene((load_hand("open", "right"),), (load_object("lidded-box"),), True, PhysicsConfig())
    model = compile_mujoco(scene)
    layout, data = model_layout(model, scene), mujoco.MjData(model)
    for mocap, pose in (
        (layout.hand_mocap[0], motion.hand_base[0]),
        (layout.object_mocap[0], motion.object_pose[0]),
    ):
        data.mocap_pos[mocap], data.mocap_quat[mocap] = pose[:3], pose[[6, 3, 4, 5]]
    bodies = {f"/World/HandRight/{link}": f"right_{link}" for link in LINKS}
    bodies |= {f"/World/Object/{part}": f"object0_{part}" for part in PARTS}
    rate = stage.GetTimeCodesPerSecond()
    opened = 0.0
    for sample, time in enumerate(motion.time):
        data.qpos[layout.hand_qpos[0]] = motion.joint_q[sample, 0]
        data.qpos[layout.hinge_qpos] = motion.hinge_angle[sample]
        mujoco.mj_kinematics(model, data)
        cache = UsdGeom.XformCache(Usd.TimeCode(time * rate))
        for path, name in bodies.items():
            matrix = np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path)))
            body = data.body(name)
            np.testing.assert_allclose(matrix[3, :3], body.xpos, atol=1e-4, err_msg=f"{path} at {time} s")
            # USD's matrices act on rows
            np.testing.assert_allclose(matrix[:3, :3].T, body.xmat.reshape(3, 3), atol=1e-4, err_msg=path)
        opened = max(opened, float(motion.hinge_angle[sample]))
    assert opened > 0.3, "the motion should move the lid"
