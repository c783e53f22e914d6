"""Joint coordinates and torques between Newton's flat arrays and ours, differentiably; places as in `newton_state`."""

import warp as wp

from .newton_state import NewtonLayout


@wp.kernel
def read_hands(
    flat_q: wp.array[float],
    flat_qd: wp.array[float],
    layout: NewtonLayout,
    joint_q: wp.array3d[float],
    joint_qd: wp.array3d[float],
):
    """Joint coordinates and velocities [W, H, 51] out of Newton's arrays; launched over [world, hand, dof]."""
    world, hand, dof = wp.tid()
    joint_q[world, hand, dof] = flat_q[world * layout.world_coords + layout.hand_coord[hand, dof]]
    joint_qd[world, hand, dof] = flat_qd[world * layout.world_dofs + layout.hand_dof[hand, dof]]


@wp.kernel
def write_hands(
    joint_q: wp.array3d[float],
    joint_qd: wp.array3d[float],
    layout: NewtonLayout,
    flat_q: wp.array[float],
    flat_qd: wp.array[float],
):
    """Joint coordinates and velocities [W, H, 51] into Newton's arrays; launched over [world, hand, dof]."""
    world, hand, dof = wp.tid()
    flat_q[world * layout.world_coords + layout.hand_coord[hand, dof]] = joint_q[world, hand, dof]
    flat_qd[world * layout.world_dofs + layout.hand_dof[hand, dof]] = joint_qd[world, hand, dof]


@wp.kernel
def write_torques(torque: wp.array3d[float], layout: NewtonLayout, joint_f: wp.array[float]):
    """Joint torques [W, H, 51], N and N.m, into Newton's joint forces; launched over [world, hand, dof]."""
    world, hand, dof = wp.tid()
    joint_f[world * layout.world_dofs + layout.hand_dof[hand, dof]] = torque[world, hand, dof]


@wp.kernel
def read_hinges(
    flat_q: wp.array[float],
    flat_qd: wp.array[float],
    layout: NewtonLayout,
    hinge_q: wp.array2d[float],
    hinge_qd: wp.array2d[float],
):
    """Hinge angles and rates [W, O] out of Newton's arrays; launched over [world, object]."""
    world, slot = wp.tid()
    hinge_q[world, slot] = flat_q[world * layout.world_coords + layout.hinge_coord[slot]]
    hinge_qd[world, slot] = flat_qd[world * layout.world_dofs + layout.hinge_dof[slot]]


@wp.kernel
def write_hinges(
    hinge_q: wp.array2d[float],
    hinge_qd: wp.array2d[float],
    layout: NewtonLayout,
    flat_q: wp.array[float],
    flat_qd: wp.array[float],
):
    """Hinge angles and rates [W, O] into Newton's arrays; launched over [world, object]."""
    world, slot = wp.tid()
    flat_q[world * layout.world_coords + layout.hinge_coord[slot]] = hinge_q[world, slot]
    flat_qd[world * layout.world_dofs + layout.hinge_dof[slot]] = hinge_qd[world, slot]
