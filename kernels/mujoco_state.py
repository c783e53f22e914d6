"""Between MuJoCo's packed double-precision state vectors and the project's arrays.

A state row is MuJoCo's FULLPHYSICS state (time, qpos, qvel, ...); a control row is
(qfrc_applied, mocap positions, mocap quaternions). This is the border where MuJoCo's wxyz quaternions become xyzw.
"""

import warp as wp

from .states import HandState, ObjectSlots

wp.set_module_options({"enable_backward": False})

START_TIME = wp.constant(wp.float64(1.0))
"""Clock of a world after a reset [s]; MuJoCo's own resets set it to zero."""


@wp.struct
class StateLayout:
    """Columns of the state, control and sensor rows, see ``simulation.mujoco_model.ModelLayout``.

    Those of the hands are [H, 51] and [H], those of the objects [O] (-1 for what a base has not), those of the sensors
    [O, H, 16, 2].
    """

    hand_qpos: wp.array2d[int]
    hand_qvel: wp.array2d[int]
    hand_force: wp.array2d[int]
    hand_mocap_position: wp.array[int]
    hand_mocap_quaternion: wp.array[int]
    hinge_qpos: wp.array[int]
    hinge_qvel: wp.array[int]
    object_qpos: wp.array[int]
    object_qvel: wp.array[int]
    object_mocap_position: wp.array[int]
    object_mocap_quaternion: wp.array[int]
    contact_sensor: wp.array4d[int]


@wp.func
def read_quaternion(row: wp.array[wp.float64], column: int) -> wp.quat:
    """An xyzw quaternion from four wxyz numbers."""
    return wp.normalize(
        wp.quat(float(row[column + 1]), float(row[column + 2]), float(row[column + 3]), float(row[column]))
    )


@wp.func
def write_quaternion(row: wp.array[wp.float64], column: int, q: wp.quat):
    """Four wxyz numbers from an xyzw quaternion."""
    row[column] = wp.float64(q[3])
    row[column + 1] = wp.float64(q[0])
    row[column + 2] = wp.float64(q[1])
    row[column + 3] = wp.float64(q[2])


@wp.func
def read_vector(row: wp.array[wp.float64], column: int) -> wp.vec3:
    """Three consecutive numbers as a vector."""
    return wp.vec3(float(row[column]), float(row[column + 1]), float(row[column + 2]))


@wp.func
def write_vector(row: wp.array[wp.float64], column: int, v: wp.vec3):
    """A vector as three consecutive numbers."""
    for axis in range(3):
        row[column + axis] = wp.float64(v[axis])


@wp.kernel
def finish_substep(
    next_state: wp.array2d[wp.float64],
    sensor: wp.array2d[wp.float64],
    layout: StateLayout,
    focus: wp.array[int],
    first_velocity: int,
    acceleration_per_velocity_change: wp.array[wp.float64],
    weight: float,
    first: int,
    # outputs
    state: wp.array2d[wp.float64],
    warmstart: wp.array2d[wp.float64],
    hands: HandState,
):
    """Take over what MuJoCo computed in a substep; launched over [world].

    One kernel, since each of its four parts is over sooner than a launch takes.

    Args:
        next_state: [W, S] state rows after the substep.
        sensor: [W, K] sensor rows.
        layout: columns.
        focus: [W] the object whose contact forces are taken.
        first_velocity: first of the state's velocity columns.
        acceleration_per_velocity_change: [V] guess of the acceleration from what a substep adds to the velocity, 1/s.
        weight: of this substep's contact forces in their mean.
        first: 1 in the first substep, whose forces replace those of the control step before.
        state: [W, S] in and out: the state rows before and after.
        warmstart: [W, V] output, accelerations from which the solver starts next.
        hands: output: joint coordinates [rad, m], their rates, and net contact forces [N, world frame].
    """
    world = wp.tid()
    for dof in range(warmstart.shape[1]):
        change = next_state[world, first_velocity + dof] - state[world, first_velocity + dof]
        warmstart[world, dof] = acceleration_per_velocity_change[dof] * change
    for column in range(state.shape[1]):
        state[world, column] = next_state[world, column]
    touched = focus[world]
    for hand in range(layout.hand_qpos.shape[0]):
        for dof in range(layout.hand_qpos.shape[1]):
            hands.joint_q[world, hand, dof] = float(next_state[world, layout.hand_qpos[hand, dof]])
            hands.joint_qd[world, hand, dof] = float(next_state[world, layout.hand_qvel[hand, dof]])
        for link in range(layout.contact_sensor.shape[2]):
            for part in range(layout.contact_sensor.shape[3]):
                force = weight * read_vector(sensor[world], layout.contact_sensor[touched, hand, link, part])
                if first == 0:
                    force += hands.contact_force[world, hand, link, part]
                hands.contact_force[world, hand, link, part] = force


@wp.kernel
def unpack_objects(
    state: wp.array2d[wp.float64],
    layout: StateLayout,
    # outputs
    slots: ObjectSlots,
    diverged: wp.array[int],
):
    """Base pose and velocity (linear of the base origin, angular; world frame) and hinge angle of every object.

    MuJoCo resets a world whose state is not finite, which shows as a clock before `START_TIME`: such a world is
    marked in ``diverged``. A fixed base keeps the pose that was written last. Launched over [world, object].
    """
    world, slot = wp.tid()
    row = state[world]
    slots.hinge_q[world, slot] = float(row[layout.hinge_qpos[slot]])
    slots.hinge_qd[world, slot] = float(row[layout.hinge_qvel[slot]])
    qpos, qvel = layout.object_qpos[slot], layout.object_qvel[slot]
    if qpos >= 0:
        rotation = read_quaternion(row, qpos + 3)
        slots.pose[world, slot] = wp.transform(read_vector(row, qpos), rotation)
        slots.velocity[world, slot] = wp.spatial_vector(
            read_vector(row, qvel), wp.quat_rotate(rotation, read_vector(row, qvel + 3))
        )
    if not (row[0] >= START_TIME):
        diverged[world] = 1


@wp.kernel
def pack_torques(joint_torque: wp.array3d[float], layout: StateLayout, control: wp.array2d[wp.float64]):
    """Write joint torques into qfrc_applied; launched over [world, hand]."""
    world, hand = wp.tid()
    for dof in range(joint_torque.shape[2]):
        control[world, layout.hand_force[hand, dof]] = wp.float64(joint_torque[world, hand, dof])


@wp.kernel
def pack_state(
    world_mask: wp.array[int],
    hands: HandState,
    slots: ObjectSlots,
    layout: StateLayout,
    # outputs
    state: wp.array2d[wp.float64],
    control: wp.array2d[wp.float64],
):
    """Write the masked worlds' arrays into MuJoCo's vectors and their clocks to `START_TIME`; launched over [world]."""
    world = wp.tid()
    if world_mask[world] == 0:
        return
    row = state[world]
    controls = control[world]
    row[0] = START_TIME
    for hand in range(layout.hand_qpos.shape[0]):
        for dof in range(layout.hand_qpos.shape[1]):
            row[layout.hand_qpos[hand, dof]] = wp.float64(hands.joint_q[world, hand, dof])
            row[layout.hand_qvel[hand, dof]] = wp.float64(hands.joint_qd[world, hand, dof])
        base = hands.hand_base[world, hand]
        write_vector(controls, layout.hand_mocap_position[hand], wp.transform_get_translation(base))
        write_quaternion(controls, layout.hand_mocap_quaternion[hand], wp.transform_get_rotation(base))
    for slot in range(layout.hinge_qpos.shape[0]):
        row[layout.hinge_qpos[slot]] = wp.float64(slots.hinge_q[world, slot])
        row[layout.hinge_qvel[slot]] = wp.float64(slots.hinge_qd[world, slot])
        position = wp.transform_get_translation(slots.pose[world, slot])
        rotation = wp.transform_get_rotation(slots.pose[world, slot])
        qpos, qvel = layout.object_qpos[slot], layout.object_qvel[slot]
        if qpos >= 0:
            write_vector(row, qpos, position)
            write_quaternion(row, qpos + 3, rotation)
            write_vector(row, qvel, wp.spatial_top(slots.velocity[world, slot]))
            angular = wp.quat_rotate_inv(rotation, wp.spatial_bottom(slots.velocity[world, slot]))
            write_vector(row, qvel + 3, angular)
        else:
            write_vector(controls, layout.object_mocap_position[slot], position)
            write_quaternion(controls, layout.object_mocap_quaternion[slot], rotation)
