"""Between the one object of every world that its hands manipulate, which most kernels read, and all of its objects."""

import warp as wp

from .states import ObjectSlots, ObjectState

wp.set_module_options({"enable_backward": False})


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
