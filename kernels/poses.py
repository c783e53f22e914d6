"""Frames compared and moved: how far apart two are, and what lies between them."""

import warp as wp

from .rotations import quat_to_rotation_vector, rotation_vector_to_quat


@wp.func
def distance_between(start: wp.transform, end: wp.transform) -> float:
    """Distance [m] of the origins of two frames."""
    return wp.length(wp.transform_get_translation(end) - wp.transform_get_translation(start))


@wp.func
def turn_between(start: wp.transform, end: wp.transform) -> wp.vec3:
    """The shortest turn from one frame to another: ``log(R_end R_start^T)``, in the frame that both are given in, rad.

    At most pi long; ``exp(turn) R_start`` gives ``R_end``.
    """
    return quat_to_rotation_vector(wp.transform_get_rotation(end) * wp.quat_inverse(wp.transform_get_rotation(start)))


@wp.func
def angle_between(start: wp.transform, end: wp.transform) -> float:
    """Angle [rad] of the shortest turn from one frame to another."""
    return wp.length(turn_between(start, end))


@wp.func
def tilt_between(start: wp.transform, end: wp.transform) -> float:
    """Angle [rad] between up and where the direction that was up in one frame points in another; both in the world."""
    up = wp.vec3(0.0, 0.0, 1.0)
    carried = wp.transform_vector(end, wp.quat_rotate_inv(wp.transform_get_rotation(start), up))
    return wp.atan2(wp.length(wp.cross(up, carried)), wp.dot(up, carried))


@wp.func
def shift_pose(pose: wp.transform, offset: wp.vec3) -> wp.transform:
    """The frame moved without turning it."""
    return wp.transform(wp.transform_get_translation(pose) + offset, wp.transform_get_rotation(pose))


@wp.func
def offset_pose(pose: wp.transform, translation: wp.vec3, rotation: wp.vec3) -> wp.transform:
    """Shift a frame and turn it about its own origin; both offsets in the frame that the pose is given in."""
    return wp.transform(
        wp.transform_get_translation(pose) + translation,
        rotation_vector_to_quat(rotation) * wp.transform_get_rotation(pose),
    )


@wp.func
def blend_poses(start: wp.transform, end: wp.transform, fraction: float) -> wp.transform:
    """Straight line between positions and shortest turn between rotations."""
    start_rotation = wp.transform_get_rotation(start)
    turn = quat_to_rotation_vector(wp.quat_inverse(start_rotation) * wp.transform_get_rotation(end))
    return wp.transform(
        wp.lerp(wp.transform_get_translation(start), wp.transform_get_translation(end), fraction),
        start_rotation * rotation_vector_to_quat(fraction * turn),
    )
