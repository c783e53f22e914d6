"""MuJoCo's packed vectors: round trips, and MuJoCo's own conventions as the independent reference."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest
import warp as wp

from artigrasp.kernels import mujoco_state, states
from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT, PARTS
from tests.kernels.samples import Sample, fill, object_slots, random_poses, random_sample

WORLD_COUNT, HAND_COUNT, OBJECT_COUNT = 6, 2, 3
STATE_SIZE, CONTROL_SIZE = 350, 150
SENSOR_COUNT = OBJECT_COUNT * HAND_COUNT * LINK_COUNT * len(PARTS)
FULL_PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS.value


@dataclass
class Packed:
    """MuJoCo's rows as the kernels see them, all of them filled with a number of their own."""

    layout: mujoco_state.StateLayout
    state: wp.array
    control: wp.array


def packed(free: bool) -> Packed:
    """Rows whose columns are scattered at random, each used once."""
    rng = np.random.default_rng(0)
    layout = mujoco_state.StateLayout()
    # the first columns: free bases, their velocities, hinges and their rates
    starts = 1 + 7 * rng.permutation(4 * OBJECT_COUNT).reshape(4, OBJECT_COUNT)
    for name, columns in zip(("object_qpos", "object_qvel", "hinge_qpos", "hinge_qvel"), starts, strict=True):
        setattr(layout, name, wp.array(columns if free or "hinge" in name else np.full_like(columns, -1), dtype=int))
    columns = 90 + rng.permutation(2 * HAND_COUNT * DOF_COUNT).reshape(2, HAND_COUNT, DOF_COUNT)
    layout.hand_qpos, layout.hand_qvel = (wp.array(each, dtype=int) for each in columns)
    layout.hand_force = wp.array(rng.permutation(HAND_COUNT * DOF_COUNT).reshape(HAND_COUNT, DOF_COUNT), dtype=int)
    positions, quaternions = 110 + 4 * rng.permutation(2 * (HAND_COUNT + OBJECT_COUNT)).reshape(2, -1)
    for kind, columns in (("position", positions), ("quaternion", quaternions)):
        hands, objects = np.split(columns, [HAND_COUNT])
        setattr(layout, f"hand_mocap_{kind}", wp.array(hands, dtype=int))
        setattr(layout, f"object_mocap_{kind}", wp.array(np.full_like(objects, -1) if free else objects, dtype=int))
    sensors = 3 * rng.permutation(SENSOR_COUNT).reshape(OBJECT_COUNT, HAND_COUNT, LINK_COUNT, len(PARTS))
    layout.contact_sensor = wp.array(sensors, dtype=int)
    rows = [rng.normal(size=(WORLD_COUNT, size)) for size in (STATE_SIZE, CONTROL_SIZE)]
    return Packed(layout, *(wp.array(each, dtype=wp.float64) for each in rows))


def pack(rows: Packed, sample: Sample, mask: np.ndarray) -> None:
    """Write the sample into the masked rows."""
    hands = fill(states.hand_state(*sample.joint_q.shape[:2]), states.HandState, sample)
    inputs = [wp.array(mask, dtype=int), hands, object_slots(sample, rows.layout.hinge_qpos.size), rows.layout]
    wp.launch(mujoco_state.pack_state, len(mask), inputs=inputs, outputs=[rows.state, rows.control])


def unpack(rows: Packed, slots: states.ObjectSlots) -> tuple[states.HandState, np.ndarray]:
    """Read the rows into a zeroed hand state and the given objects; the flags of diverged worlds."""
    hands = states.hand_state(WORLD_COUNT, HAND_COUNT)
    diverged = wp.zeros(WORLD_COUNT, dtype=int)
    finish_substep(rows.layout, rows.state.numpy(), hands=hands)
    wp.launch(
        mujoco_state.unpack_objects, slots.pose.shape, inputs=[rows.state, rows.layout], outputs=[slots, diverged]
    )
    return hands, diverged.numpy()


def finish_substep(
    layout: mujoco_state.StateLayout,
    next_state: np.ndarray,
    *,
    hands: states.HandState,
    state: np.ndarray | None = None,
    sensor: np.ndarray | None = None,
    focus: np.ndarray | None = None,
    first: bool = True,
    acceleration_per_velocity_change: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Launch the kernel of that name, a quarter of whose forces count; the new state and warm start.

    The last columns of the state are its velocities.
    """
    sensor = np.zeros((WORLD_COUNT, 3 * SENSOR_COUNT)) if sensor is None else sensor
    focus = np.zeros(WORLD_COUNT, int) if focus is None else focus
    gain = np.ones(5) if acceleration_per_velocity_change is None else acceleration_per_velocity_change
    warmstart = wp.zeros((WORLD_COUNT, len(gain)), dtype=wp.float64)
    state_rows = wp.array(np.zeros_like(next_state) if state is None else state, dtype=wp.float64)
    wp.launch(
        mujoco_state.finish_substep,
        WORLD_COUNT,
        inputs=[
            *(wp.array(each, dtype=wp.float64) for each in (next_state, sensor)),
            layout,
            wp.array(focus, dtype=int),
            next_state.shape[1] - len(gain),
            wp.array(gain, dtype=wp.float64),
            0.25,
            int(first),
        ],
        outputs=[state_rows, warmstart, hands],
    )
    return state_rows.numpy(), warmstart.numpy()


def quaternions_agree(found: np.ndarray, expected: np.ndarray) -> None:
    """Equal up to the sign of the whole quaternion."""
    np.testing.assert_allclose(np.abs((found * expected).sum(-1)), 1.0, atol=1e-6)


@pytest.mark.parametrize("free", [True, False], ids=["free", "fixed"])
def test_what_was_packed_is_unpacked(free: bool) -> None:
    """Joints, hinge and, of a free base, pose and velocity come back; a fixed base keeps what it was."""
    rows, sample = packed(free), random_sample(WORLD_COUNT)
    pack(rows, sample, np.ones(WORLD_COUNT, int))
    objects = states.object_slots(WORLD_COUNT, OBJECT_COUNT)
    objects.pose.assign(random_poses(np.random.default_rng(1), WORLD_COUNT, OBJECT_COUNT))
    before = objects.pose.numpy().copy()
    hands, diverged = unpack(rows, objects)
    expected = object_slots(sample, OBJECT_COUNT)
    for name in ("joint_q", "joint_qd"):
        np.testing.assert_array_equal(getattr(hands, name).numpy(), getattr(sample, name).astype(np.float32))
    for name in ("hinge_q", "hinge_qd"):
        np.testing.assert_array_equal(getattr(objects, name).numpy(), getattr(expected, name).numpy())
    assert not diverged.any()
    if free:
        np.testing.assert_array_equal(objects.pose.numpy()[..., :3], expected.pose.numpy()[..., :3])
        quaternions_agree(objects.pose.numpy()[..., 3:], expected.pose.numpy()[..., 3:])
        np.testing.assert_allclose(objects.velocity.numpy(), expected.velocity.numpy(), atol=1e-5)
    else:
        np.testing.assert_array_equal(objects.pose.numpy(), before)
        np.testing.assert_array_equal(objects.velocity.numpy(), 0.0)


@pytest.mark.parametrize("free", [True, False], ids=["free", "fixed"])
def test_mocap_bodies_get_wxyz(free: bool) -> None:
    """Hand bases, and the bases of fixed objects, become mocap poses with the scalar first."""
    rows, sample = packed(free), random_sample(WORLD_COUNT)
    pack(rows, sample, np.ones(WORLD_COUNT, int))
    control, layout = rows.control.numpy(), rows.layout
    poses = [
        (
            sample.hand_base[:, hand],
            layout.hand_mocap_position.numpy()[hand],
            layout.hand_mocap_quaternion.numpy()[hand],
        )
        for hand in range(HAND_COUNT)
    ]
    if not free:
        pose = object_slots(sample, OBJECT_COUNT).pose.numpy()
        poses += [
            (pose[:, slot], layout.object_mocap_position.numpy()[slot], layout.object_mocap_quaternion.numpy()[slot])
            for slot in range(OBJECT_COUNT)
        ]
    for pose, position, quaternion in poses:
        np.testing.assert_allclose(control[:, position : position + 3], pose[:, :3], atol=1e-7)
        np.testing.assert_allclose(control[:, quaternion : quaternion + 4], pose[:, [6, 3, 4, 5]], atol=1e-7)


def test_only_masked_worlds_are_packed() -> None:
    """Rows of other worlds keep every number."""
    rows = packed(free=True)
    state, control = rows.state.numpy().copy(), rows.control.numpy().copy()
    mask = np.arange(WORLD_COUNT) % 2
    pack(rows, random_sample(WORLD_COUNT), mask)
    for now, before in ((rows.state.numpy(), state), (rows.control.numpy(), control)):
        np.testing.assert_array_equal(now[mask == 0], before[mask == 0])
        assert (now[mask == 1] != before[mask == 1]).any(axis=1).all()


def test_a_clock_that_was_set_back_is_divergence() -> None:
    """MuJoCo's own reset sets time to zero, and not a number is no time either; both mark the world."""
    rows = packed(free=True)
    pack(rows, random_sample(WORLD_COUNT), np.ones(WORLD_COUNT, int))
    state = rows.state.numpy().copy()
    state[:, 0] += 0.01
    state[1, 0], state[4, 0] = 0.01, np.nan
    rows.state.assign(state)
    _, diverged = unpack(rows, states.object_slots(WORLD_COUNT, OBJECT_COUNT))
    np.testing.assert_array_equal(diverged, [0, 1, 0, 0, 1, 0])


def test_contact_forces_are_averaged() -> None:
    """Those of the object in focus: the first substep replaces what was there, the others add to it."""
    rng = np.random.default_rng(0)
    layout = packed(free=True).layout
    readings = rng.normal(size=(4, WORLD_COUNT, 3 * SENSOR_COUNT))
    focus = np.arange(WORLD_COUNT) % OBJECT_COUNT
    hands = states.hand_state(WORLD_COUNT, HAND_COUNT)
    hands.contact_force.fill_(wp.vec3(5.0, 5.0, 5.0))
    for substep, reading in enumerate(readings):
        next_state = np.zeros((WORLD_COUNT, STATE_SIZE))
        finish_substep(layout, next_state, hands=hands, sensor=reading, focus=focus, first=substep == 0)
    columns = layout.contact_sensor.numpy()[focus][..., None] + np.arange(3)
    worlds = np.arange(WORLD_COUNT)[:, None, None, None, None]
    np.testing.assert_allclose(hands.contact_force.numpy(), readings.mean(axis=0)[worlds, columns], atol=1e-6)


def test_the_next_state_and_the_warm_start_are_taken_over() -> None:
    """The state becomes the next one, and the solver starts from what the velocities changed by, times a gain."""
    rng = np.random.default_rng(0)
    before, after = rng.normal(size=(2, WORLD_COUNT, STATE_SIZE))
    gain = rng.uniform(400.0, 1000.0, size=60)
    state, warmstart = finish_substep(
        packed(free=True).layout,
        after,
        hands=states.hand_state(WORLD_COUNT, HAND_COUNT),
        state=before,
        acceleration_per_velocity_change=gain,
    )
    np.testing.assert_array_equal(state, after)
    np.testing.assert_allclose(warmstart, gain * (after - before)[:, -60:], rtol=1e-12)


def test_torques_reach_their_columns() -> None:
    """Each joint's torque lands where MuJoCo applies it, and nothing else of the controls changes."""
    rows = packed(free=True)
    before = rows.control.numpy().copy()
    torque = random_sample(WORLD_COUNT).joint_q
    wp.launch(
        mujoco_state.pack_torques,
        (WORLD_COUNT, HAND_COUNT),
        inputs=[wp.array(torque, dtype=float), rows.layout, rows.control],
    )
    before[:, rows.layout.hand_force.numpy()] = torque.astype(np.float32)
    np.testing.assert_array_equal(rows.control.numpy(), before)


def test_a_free_base_moves_as_mujoco_says() -> None:
    """Our velocity (of the frame's origin, world frame) is MuJoCo's own of that body, whose centre of mass is away."""
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><worldbody><body name="base"><freejoint/><geom size=".1" pos=".3 .2 -.1"/>
        <body name="lid" pos="0 .1 .1"><joint name="hinge" axis="-1 0 0"/><geom size=".05" pos="0 -.1 0"/></body>
        </body></worldbody></mujoco>
    """)
    layout = mujoco_state.StateLayout()
    layout.hand_qpos = layout.hand_qvel = layout.hand_force = wp.zeros((0, DOF_COUNT), dtype=int)
    layout.hand_mocap_position = layout.hand_mocap_quaternion = wp.zeros(0, dtype=int)
    layout.contact_sensor = wp.zeros((1, 0, LINK_COUNT, len(PARTS)), dtype=int)
    for name, column in {"object_qpos": 1, "hinge_qpos": 8, "object_qvel": 9, "hinge_qvel": 15}.items():
        setattr(layout, name, wp.full(1, column, dtype=int))
    size = mujoco.mj_stateSize(model, FULL_PHYSICS)
    rows = Packed(layout, wp.zeros((WORLD_COUNT, size), dtype=wp.float64), wp.zeros((WORLD_COUNT, 0), dtype=wp.float64))
    sample = random_sample(WORLD_COUNT)
    pack(rows, sample, np.ones(WORLD_COUNT, int))
    data = mujoco.MjData(model)
    for world in range(WORLD_COUNT):
        mujoco.mj_setState(model, data, rows.state.numpy()[world], FULL_PHYSICS)
        mujoco.mj_forward(model, data)
        body = data.body("base")
        np.testing.assert_allclose(body.xpos, sample.pose[world, :3], atol=1e-6)
        quaternions_agree(body.xquat, sample.pose[world, [6, 3, 4, 5]])
        velocity = np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body.id, velocity, 0)
        np.testing.assert_allclose(np.roll(velocity, 3), sample.velocity[world], atol=1e-5)
        assert data.joint("hinge").qpos[0] == pytest.approx(sample.hinge_q[world], abs=1e-6)
        assert data.joint("hinge").qvel[0] == pytest.approx(sample.hinge_qd[world], abs=1e-6)
