"""Poses of both parts of a hinged object over a batch."""

import warp as wp

from .kinematics import part_pose


@wp.kernel
def pose_parts(
    object_pose: wp.array[wp.transform],
    hinge_angle: wp.array[float],
    hinge_origin: wp.vec3,
    hinge_axis: wp.vec3,
    part_poses: wp.array2d[wp.transform],
):
    """Frames of both parts, from the frame of the base and the hinge angle [rad].

    Launch with ``dim=(W, 2)``. All frames: world; m. The hinge is given in the base frame.
    """
    world, part = wp.tid()
    part_poses[world, part] = part_pose(object_pose[world], hinge_origin, hinge_axis, hinge_angle[world], part)
