"""Between Newton's flat state arrays and the project's arrays ``[world, hand, ...]`` and ``[world, object]``.

All worlds have the same joints in the same order, so that a coordinate of a world is its place in the first world plus
a stride. Newton gives the velocity of a free body's centre of mass; ours is that of the base frame's origin.
"""

import warp as wp

from .states import HandState, ObjectSlots

wp.set_module_options({"enable_backward": False})

MAX_VALUE = wp.constant(1.0e10)
"""Size of a coordinate or velocity from which on a world counts as failed, as in MuJoCo."""

NO_FREE_BASE = wp.constant(-1)
"""`NewtonLayout.object_coord` of objects whose base is fixed."""


@wp.struct
class NewtonLayout:
    """Places in Newton's arrays, see ``simulation.newton``.

    Attributes:
        world_coords, world_dofs, world_joints, world_bodies: strides, joint coordinates (dofs, ...) of one world.
        hand_coord, hand_dof: [H, 51] places of the hand coordinates among a world's coordinates and dofs.
        hand_base_joint: [H] the fixed joint that carries each hand's base.
        hinge_coord, hinge_dof: [O] places of the objects' hinges.
        object_coord, object_dof: [O] first places of free bases, `NO_FREE_BASE` for fixed ones.
        object_base_joint, object_base_body: [O] joints and bodies of the objects' bases.
        shape_world: [shape] world of a shape, -1 for none.
        shape_link: [shape] ``hand * link count + link`` of the link that a shape belongs to, -1 for none.
        shape_part: [shape] ``object * part count + part`` of the part that a shape belongs to, -1 for none.
    """

    world_coords: int
    world_dofs: int
    world_joints: int
    world_bodies: int
    hand_coord: wp.array2d[int]
    hand_dof: wp.array2d[int]
    hand_base_joint: wp.array[int]
    hinge_coord: wp.array[int]
    hinge_dof: wp.array[int]
    object_coord: wp.array[int]
    object_dof: wp.array[int]
    object_base_joint: wp.array[int]
    object_base_body: wp.array[int]
    shape_world: wp.array[int]
    shape_link: wp.array[int]
    shape_part: wp.array[int]


@wp.kernel
def check_worlds(
    joint_q: wp.array[float],
    joint_qd: wp.array[float],
    overflow: wp.array[int],
    overflow_bits: int,
    layout: NewtonLayout,
    # outputs
    failed: wp.array[wp.bool],
    diverged: wp.array[int],
    overflow_count: wp.array[int],
):
    """Find the worlds whose physics just failed, mark them in ``diverged``, count overflows; launched over [world]."""
    world = wp.tid()
    failed[world] = False
    for coord in range(layout.world_coords):
        if not (wp.abs(joint_q[world * layout.world_coords + coord]) < MAX_VALUE):
            failed[world] = True
    for dof in range(layout.world_dofs):
        if not (wp.abs(joint_qd[world * layout.world_dofs + dof]) < MAX_VALUE):
            failed[world] = True
    if failed[world]:
        diverged[world] = 1
    if (overflow[world] & overflow_bits) != 0:
        overflow_count[world] += 1


@wp.kernel
def unpack_hands(
    joint_q: wp.array[float],
    joint_qd: wp.array[float],
    failed: wp.array[wp.bool],
    layout: NewtonLayout,
    # outputs
    hands: HandState,
):
    """Joint coordinates and velocities of every hand, and no contact where the physics failed.

    Launched over [world, hand].
    """
    world, hand = wp.tid()
    for dof in range(layout.hand_coord.shape[1]):
        hands.joint_q[world, hand, dof] = joint_q[world * layout.world_coords + layout.hand_coord[hand, dof]]
        hands.joint_qd[world, hand, dof] = joint_qd[world * layout.world_dofs + layout.hand_dof[hand, dof]]
    if failed[world]:
        for link in range(hands.contact_force.shape[2]):
            for part in range(hands.contact_force.shape[3]):
                hands.contact_force[world, hand, link, part] = wp.vec3()


@wp.kernel
def unpack_objects(
    joint_q: wp.array[float],
    joint_qd: wp.array[float],
    body_com: wp.array[wp.vec3],
    layout: NewtonLayout,
    # outputs
    slots: ObjectSlots,
):
    """Base pose and velocity (linear of the base origin, angular; world frame) and hinge angle of every object.

    A fixed base keeps the pose that was written last. Launched over [world, object].
    """
    world, slot = wp.tid()
    slots.hinge_q[world, slot] = joint_q[world * layout.world_coords + layout.hinge_coord[slot]]
    slots.hinge_qd[world, slot] = joint_qd[world * layout.world_dofs + layout.hinge_dof[slot]]
    if layout.object_coord[slot] != NO_FREE_BASE:
        coord = world * layout.world_coords + layout.object_coord[slot]
        dof = world * layout.world_dofs + layout.object_dof[slot]
        rotation = wp.normalize(wp.quat(joint_q[coord + 3], joint_q[coord + 4], joint_q[coord + 5], joint_q[coord + 6]))
        position = wp.vec3(joint_q[coord], joint_q[coord + 1], joint_q[coord + 2])
        com = wp.quat_rotate(rotation, body_com[world * layout.world_bodies + layout.object_base_body[slot]])
        com_velocity = wp.vec3(joint_qd[dof], joint_qd[dof + 1], joint_qd[dof + 2])
        angular = wp.vec3(joint_qd[dof + 3], joint_qd[dof + 4], joint_qd[dof + 5])
        slots.pose[world, slot] = wp.transform(position, rotation)
        slots.velocity[world, slot] = wp.spatial_vector(com_velocity - wp.cross(angular, com), angular)


@wp.kernel
def accumulate_contact_force(
    contact_count: wp.array[int],
    shape0: wp.array[int],
    shape1: wp.array[int],
    force_on_shape0: wp.array[wp.spatial_vector],
    layout: NewtonLayout,
    focus: wp.array[int],
    weight: float,
    # outputs
    hands: HandState,
):
    """Add one substep's contact forces [N, world frame] of each part on each link; launched over [contact].

    Only those of the object in ``focus``, [W], count.
    """
    contact = wp.tid()
    if contact >= contact_count[0]:
        return
    first, second = shape0[contact], shape1[contact]
    on_first = layout.shape_link[first] >= 0
    link = layout.shape_link[wp.where(on_first, first, second)]
    part = layout.shape_part[wp.where(on_first, second, first)]
    if link < 0 or part < 0:
        return
    world, link_count, part_count = (
        layout.shape_world[first],
        hands.contact_force.shape[2],
        hands.contact_force.shape[3],
    )
    if part // part_count != focus[world]:
        return
    force = wp.where(on_first, weight, -weight) * wp.spatial_top(force_on_shape0[contact])
    wp.atomic_add(hands.contact_force, world, link // link_count, link % link_count, part % part_count, force)


@wp.kernel
def pack_state(
    world_mask: wp.array[int],
    hands: HandState,
    slots: ObjectSlots,
    body_com: wp.array[wp.vec3],
    layout: NewtonLayout,
    # outputs
    joint_q: wp.array[float],
    joint_qd: wp.array[float],
    joint_frame: wp.array[wp.transform],
    written: wp.array[wp.bool],
):
    """Write the masked worlds' arrays into Newton's and mark these worlds in ``written``; launched over [world].

    Hand bases and fixed object bases are poses of the joints that fix them: Newton moves the mocap bodies there.
    """
    world = wp.tid()
    written[world] = world_mask[world] != 0
    if world_mask[world] == 0:
        return
    coords, dofs, joints = world * layout.world_coords, world * layout.world_dofs, world * layout.world_joints
    for hand in range(layout.hand_coord.shape[0]):
        joint_frame[joints + layout.hand_base_joint[hand]] = hands.hand_base[world, hand]
        for dof in range(layout.hand_coord.shape[1]):
            joint_q[coords + layout.hand_coord[hand, dof]] = hands.joint_q[world, hand, dof]
            joint_qd[dofs + layout.hand_dof[hand, dof]] = hands.joint_qd[world, hand, dof]
    for slot in range(layout.hinge_coord.shape[0]):
        joint_q[coords + layout.hinge_coord[slot]] = slots.hinge_q[world, slot]
        joint_qd[dofs + layout.hinge_dof[slot]] = slots.hinge_qd[world, slot]
        pose = slots.pose[world, slot]
        if layout.object_coord[slot] == NO_FREE_BASE:
            joint_frame[joints + layout.object_base_joint[slot]] = pose
        else:
            position, rotation = wp.transform_get_translation(pose), wp.transform_get_rotation(pose)
            angular = wp.spatial_bottom(slots.velocity[world, slot])
            com = wp.quat_rotate(rotation, body_com[world * layout.world_bodies + layout.object_base_body[slot]])
            linear = wp.spatial_top(slots.velocity[world, slot]) + wp.cross(angular, com)
            first_coord, first_dof = coords + layout.object_coord[slot], dofs + layout.object_dof[slot]
            for axis in range(3):
                joint_q[first_coord + axis] = position[axis]
                joint_qd[first_dof + axis] = linear[axis]
                joint_qd[first_dof + 3 + axis] = angular[axis]
            for axis in range(4):
                joint_q[first_coord + 3 + axis] = rotation[axis]
