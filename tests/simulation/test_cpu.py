"""The CPU backend against MuJoCo itself, and its resets."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand_table import hand_table
from artigrasp.kernels import kinematics
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.mujoco_model import model_layout
from tests.simulation.scenes import open_scene

WORLDS = 5


@pytest.fixture(params=[True, False], ids=["fixed", "free"])
def simulation(request: pytest.FixtureRequest) -> CpuSimulation:
    """Worlds in random states: hands near the object, which stands on the table, turned and with an open lid."""
    # enough iterations that the solver converges from any warm start
    scene = open_scene(request.param)
    simulation = CpuSimulation([replace(scene, physics=replace(scene.physics, iterations=100))], [WORLDS])
    rng = np.random.default_rng(3)
    joint_q = rng.uniform(-0.3, 0.3, (WORLDS, 1, 51))
    joint_q[..., :3] = rng.uniform(-0.02, 0.02, (WORLDS, 1, 3))
    base = np.tile([0.12, 0.0, 0.12, 0.0, 0.0, 0.0, 1.0], (WORLDS, 1, 1))
    pose = np.zeros((WORLDS, 7))
    half = rng.uniform(-0.5, 0.5, WORLDS)
    pose[:, 5], pose[:, 6] = np.sin(half), np.cos(half)
    pose[:, :2] = rng.uniform(-0.05, 0.05, (WORLDS, 2))
    hands, objects = simulation.state.hands, simulation.state.objects
    hands.joint_q.assign(joint_q.astype(np.float32))
    hands.joint_qd.assign(rng.uniform(-0.5, 0.5, joint_q.shape).astype(np.float32))
    hands.hand_base.assign(base.astype(np.float32))
    objects.pose.assign(pose.astype(np.float32))
    objects.hinge_q.assign(rng.uniform(0.1, 0.6, WORLDS).astype(np.float32))
    objects.hinge_qd.assign(rng.uniform(-0.5, 0.5, WORLDS).astype(np.float32))
    if not request.param:
        objects.velocity.assign(rng.uniform(-0.2, 0.2, (WORLDS, 6)).astype(np.float32))
    simulation.write_state(wp.full(WORLDS, 1, dtype=int, device="cpu"))
    return simulation


def plain_mujoco(simulation: CpuSimulation, world: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The same world in MuJoCo's own data structure, filled from the arrays that the project documents."""
    model, scene = simulation.models[0], simulation.scenes[0]
    layout = model_layout(model, scene)
    data = mujoco.MjData(model)
    hands, objects = simulation.state.hands, simulation.state.objects
    data.qpos[layout.hand_qpos[0]] = hands.joint_q.numpy()[world, 0]
    data.qvel[layout.hand_dof[0]] = hands.joint_qd.numpy()[world, 0]
    data.qpos[layout.hinge_qpos[0]] = objects.hinge_q.numpy()[world]
    data.qvel[layout.hinge_dof[0]] = objects.hinge_qd.numpy()[world]
    base, pose = hands.hand_base.numpy()[world, 0], objects.pose.numpy()[world]
    data.mocap_pos[layout.hand_mocap[0]] = base[:3]
    data.mocap_quat[layout.hand_mocap[0]] = base[[6, 3, 4, 5]]
    if scene.fixed_base:
        data.mocap_pos[layout.object_mocap[0]] = pose[:3]
        data.mocap_quat[layout.object_mocap[0]] = pose[[6, 3, 4, 5]]
    else:
        data.qpos[layout.object_qpos[0] : layout.object_qpos[0] + 7] = pose[[0, 1, 2, 6, 3, 4, 5]]
        velocity = objects.velocity.numpy()[world]
        data.qvel[layout.object_dof[0] : layout.object_dof[0] + 3] = velocity[:3]
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, pose[[6, 3, 4, 5]].astype(np.float64))
        data.qvel[layout.object_dof[0] + 3 : layout.object_dof[0] + 6] = rotation.reshape(3, 3).T @ velocity[3:]
    mujoco.mj_forward(model, data)
    return model, data


def test_kinematics_are_mujocos(simulation: CpuSimulation) -> None:
    """Link frames and fingertips from the Warp chain, and part frames from the hinge, are MuJoCo's body frames."""
    hand, scene = simulation.scenes[0].hands[0], simulation.scenes[0]
    table = hand_table([hand], "cpu")
    hands = simulation.state.hands
    wp.launch(kinematics.forward_kinematics, (WORLDS, 1), inputs=[hands, table], device="cpu")
    for world in range(WORLDS):
        _, data = plain_mujoco(simulation, world)
        for link, name in enumerate(LINKS):
            pose = hands.link_pose.numpy()[world, 0, link]
            body = data.body(f"{hand.side}_{name}")
            np.testing.assert_allclose(pose[:3], body.xpos, atol=1e-6)
            np.testing.assert_allclose(abs(pose[[6, 3, 4, 5]] @ body.xquat), 1.0, atol=1e-6)
        base = simulation.state.objects.pose.numpy()[world]
        np.testing.assert_allclose(data.body("object0_base").xpos, base[:3], atol=1e-6)
        lid = data.body("object0_articulated")
        angle = float(simulation.state.objects.hinge_q.numpy()[world])
        position, orientation = scene.objects[0].articulated_pose_in_base(angle)
        in_base = data.body("object0_base").xmat.reshape(3, 3).T
        np.testing.assert_allclose(in_base @ (lid.xpos - data.body("object0_base").xpos), position, atol=1e-6)
        turned = Rotation.from_quat(orientation).as_matrix()
        np.testing.assert_allclose(in_base @ lid.xmat.reshape(3, 3), turned, atol=1e-6)


def test_a_control_step_is_four_mujoco_steps(simulation: CpuSimulation) -> None:
    """Torques held over the substeps, poses, velocities and mean contact forces are those of plain mj_step."""
    rng = np.random.default_rng(5)
    torque = rng.uniform(-0.2, 0.2, (WORLDS, 1, 51)).astype(np.float32)
    worlds = [plain_mujoco(simulation, world) for world in range(WORLDS)]
    layout = model_layout(simulation.models[0], simulation.scenes[0])
    simulation.joint_torque.assign(torque)
    simulation.step(lambda rows: None)
    state = simulation.state
    touched = 0
    for world, (model, data) in enumerate(worlds):
        data.qfrc_applied[layout.hand_dof[0]] = torque[world, 0]
        force = np.zeros((len(LINKS), len(PARTS), 3))
        for _ in range(simulation.substeps):
            mujoco.mj_step(model, data)
            force += data.sensordata[layout.contact_sensor[0, 0][..., None] + np.arange(3)] / simulation.substeps
        touched += int(np.abs(force).max() > 0.01)
        np.testing.assert_allclose(state.hands.joint_q.numpy()[world, 0], data.qpos[layout.hand_qpos[0]], atol=2e-5)
        np.testing.assert_allclose(state.hands.joint_qd.numpy()[world, 0], data.qvel[layout.hand_dof[0]], atol=5e-3)
        np.testing.assert_allclose(state.objects.hinge_q.numpy()[world], data.qpos[layout.hinge_qpos[0]], atol=2e-5)
        found = state.hands.contact_force.numpy()[world, 0]
        np.testing.assert_allclose(found, force, atol=0.02 * max(1.0, np.abs(force).max()))
        if not simulation.scenes[0].fixed_base:
            np.testing.assert_allclose(state.objects.pose.numpy()[world, :3], data.body("object0_base").xpos, atol=1e-3)
    assert touched > 0, "the random states should include contact"
    assert (state.diverged.numpy() == 0).all()


def test_contact_force_acts_on_the_right_link() -> None:
    """A fingertip pressed into the lid reports its force on that link and part, and on no other."""
    simulation = CpuSimulation([open_scene(True)], [1])
    state = simulation.state
    hand = simulation.scenes[0].hands[0]
    lid_top = simulation.scenes[0].objects[0].parts[1].vertices[:, 2].max()
    centre = simulation.scenes[0].objects[0].parts[1].vertices.mean(axis=0)
    reach = hand.link_offset[1] + hand.link_offset[2] + hand.link_offset[3] + hand.tip_offset[1]
    base = np.array([*(centre - reach)[:2], lid_top + 0.2, 0.0, 0.0, 0.0, 1.0], dtype=np.float32)
    # curl the index finger down so that it alone reaches the lid
    joint_q = np.zeros(51, dtype=np.float32)
    joint_q[8] = 1.4
    state.hands.hand_base.assign(base[None, None])
    state.hands.joint_q.assign(joint_q[None, None])
    everyone = wp.full(1, 1, dtype=int, device="cpu")
    simulation.write_state(everyone)
    model, data = plain_mujoco(simulation, 0)
    tip = min(range(model.ngeom), key=lambda geom: _lowest(model, data, geom, hand.side))
    body = model.body(model.geom_bodyid[tip]).name
    drop = _lowest(model, data, tip, hand.side) - lid_top
    base[2] -= drop + 0.001
    state.hands.hand_base.assign(base[None, None])
    state.hands.joint_q.assign(joint_q[None, None])
    simulation.write_state(everyone)
    simulation.step(lambda rows: None)
    force = np.linalg.norm(state.hands.contact_force.numpy()[0, 0], axis=-1)
    link = LINKS.index(body.removeprefix(f"{hand.side}_"))
    assert force[link, 1] > 0.0
    force[link, 1] = 0.0
    assert (force == 0.0).all()


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int, side: str) -> float:
    """Height of a hand capsule's lowest point; infinite for anything else."""
    if not model.body(model.geom_bodyid[geom]).name.startswith(f"{side}_"):
        return np.inf
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.inf
    axis = data.geom_xmat[geom].reshape(3, 3)[:, 2]
    return float(data.geom_xpos[geom, 2] - abs(axis[2]) * model.geom_size[geom, 1] - model.geom_size[geom, 0])


def test_writing_some_worlds_leaves_the_others_alone(simulation: CpuSimulation) -> None:
    """A masked write resets just its worlds: the others go on bit for bit as they would have."""
    copy = CpuSimulation(simulation.scenes, [WORLDS])
    copy.packed.state[:] = simulation.packed.state
    copy.packed.control[:] = simulation.packed.control
    for each in (simulation, copy):
        each.step(lambda rows: None)
    simulation.state.hands.joint_q.zero_()
    mask = np.array([1, 0, 0, 1, 0])
    simulation.write_state(wp.array(mask, dtype=int, device="cpu"))
    for each in (simulation, copy):
        each.step(lambda rows: None)
    kept = mask == 0
    np.testing.assert_array_equal(simulation.packed.state[kept], copy.packed.state[kept])
    assert (simulation.packed.state[~kept, 0] < copy.packed.state[~kept, 0]).all()


def test_failed_physics_is_marked() -> None:
    """A world that MuJoCo had to reset is marked, whatever its neighbours do."""
    simulation = CpuSimulation([open_scene(True)], [2])
    simulation.write_state(wp.full(2, 1, dtype=int, device="cpu"))
    simulation.step(lambda rows: None)
    speed = simulation.state.hands.joint_qd.numpy().copy()
    speed[1] = np.nan
    simulation.state.hands.joint_qd.assign(speed)
    simulation.write_state(wp.array([0, 1], dtype=int, device="cpu"))
    simulation.step(lambda rows: None)
    assert simulation.state.diverged.numpy().tolist() == [0, 1]
