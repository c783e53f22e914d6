"""Between the one object of every world that its hands manipulate, which most kernels read, and all of its objects."""

import warp as wp

from .states import Goal, ObjectModel, ObjectSlots, ObjectState

wp.set_module_options({"enable_backward": False})


@wp.kernel
def set_focus(world_mask: wp.array[int], slot: int, focus: wp.array[int]):
    """Let ``focus``, [W], be ``slot`` in the masked worlds; launched over [world]."""
    world = wp.tid()
    if world_mask[world] != 0:
        focus[world] = slot


@wp.kernel
def read_focus(focus: wp.array[int], slots: ObjectSlots, objects: ObjectState):
    """Copy the object in ``focus``, [W], out of ``slots``; launched over [world]."""
    world = wp.tid()
    slot = focus[world]
    objects.pose[world] = slots.pose[world, slot]
    objects.velocity[world] = slots.velocity[world, slot]
    objects.hinge_q[world] = slots.hinge_q[world, slot]
    objects.hinge_qd[world] = slots.hinge_qd[world, slot]


@wp.kernel
def write_focus(world_mask: wp.array[int], focus: wp.array[int], objects: ObjectState, slots: ObjectSlots):
    """Copy the masked worlds' ``objects`` into the slots in ``focus``, both [W]; launched over [world]."""
    world = wp.tid()
    if world_mask[world] == 0:
        return
    slot = focus[world]
    slots.pose[world, slot] = objects.pose[world]
    slots.velocity[world, slot] = objects.velocity[world]
    slots.hinge_q[world, slot] = objects.hinge_q[world]
    slots.hinge_qd[world, slot] = objects.hinge_qd[world]


@wp.kernel
def place_objects(world_mask: wp.array[int], places: ObjectSlots, slots: ObjectSlots):
    """Put the masked worlds' objects in their places; launched over [world]."""
    world = wp.tid()
    if world_mask[world] == 0:
        return
    for slot in range(slots.pose.shape[1]):
        slots.pose[world, slot] = places.pose[world, slot]
        slots.velocity[world, slot] = places.velocity[world, slot]
        slots.hinge_q[world, slot] = places.hinge_q[world, slot]
        slots.hinge_qd[world, slot] = places.hinge_qd[world, slot]


@wp.kernel
def describe_focus(
    world_mask: wp.array[int],
    slot: int,
    slot_model: ObjectModel,
    slot_mass: wp.array[float],
    slots: ObjectSlots,
    # outputs
    object_model: ObjectModel,
    object_mass: wp.array[float],
    goal: Goal,
):
    """Take over what does not change of the masked worlds' object in ``slot``; launched over [world].

    Displacements count from where the object is now.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    object_model.hinge_origin[world] = slot_model.hinge_origin[world]
    object_model.hinge_axis[world] = slot_model.hinge_axis[world]
    for part in range(slot_model.part_mass.shape[1]):
        object_model.part_mass[world, part] = slot_model.part_mass[world, part]
    object_mass[world] = slot_mass[world]
    goal.start_object_pose[world] = slots.pose[world, slot]
    goal.start_angle[world] = slots.hinge_q[world, slot]
