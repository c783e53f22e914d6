"""Rotations as quaternions (xyzw), intrinsic XYZ Euler angles and rotation vectors."""

import warp as wp

SMALL_SINE_SQUARED = wp.constant(1.0e-6)
"""Below this squared (half-angle) sine the series are exact to float32, and their gradients finite."""


@wp.func
def euler_xyz_to_quat(x: float, y: float, z: float) -> wp.quat:
    """Quaternion of ``R = Rx @ Ry @ Rz`` (intrinsic XYZ), angles in radians."""
    half_x = wp.quat(wp.sin(0.5 * x), 0.0, 0.0, wp.cos(0.5 * x))
    half_y = wp.quat(0.0, wp.sin(0.5 * y), 0.0, wp.cos(0.5 * y))
    half_z = wp.quat(0.0, 0.0, wp.sin(0.5 * z), wp.cos(0.5 * z))
    return half_x * half_y * half_z


@wp.func
def quat_to_euler_xyz(q: wp.quat) -> wp.vec3:
    """Intrinsic XYZ Euler angles of a unit quaternion, the middle one in [-pi/2, pi/2] rad."""
    x_axis = wp.quat_rotate_inv(q, wp.vec3(1.0, 0.0, 0.0))
    z_column = wp.quat_rotate(q, wp.vec3(0.0, 0.0, 1.0))
    # Rows and columns of R = Rx Ry Rz: R[0] = (cy cz, -cy sz, sy), R[:, 2] = (sy, -sx cy, cx cy).
    cosine = wp.sqrt(x_axis[0] * x_axis[0] + x_axis[1] * x_axis[1])
    return wp.vec3(
        wp.atan2(-z_column[1], z_column[2]),
        wp.atan2(x_axis[2], cosine),
        wp.atan2(-x_axis[1], x_axis[0]),
    )


@wp.func
def quat_to_rotation_vector(q: wp.quat) -> wp.vec3:
    """Shortest rotation vector (axis times angle <= pi, rad) of a unit quaternion; smooth at the identity."""
    sine = wp.vec3(q[0], q[1], q[2])
    cosine = q[3]
    if cosine < 0.0:
        sine = -sine
        cosine = -cosine
    sine_squared = wp.length_sq(sine)
    scale = 2.0 + sine_squared / 3.0
    if sine_squared > SMALL_SINE_SQUARED:
        length = wp.sqrt(sine_squared)
        scale = 2.0 * wp.atan2(length, cosine) / length
    return scale * sine


@wp.func
def rotation_vector_to_quat(r: wp.vec3) -> wp.quat:
    """Unit quaternion of a rotation vector (rad); smooth at zero."""
    angle_squared = wp.length_sq(r)
    scale = 0.5 - angle_squared / 48.0
    cosine = 1.0 - angle_squared / 8.0
    if angle_squared > SMALL_SINE_SQUARED:
        angle = wp.sqrt(angle_squared)
        scale = wp.sin(0.5 * angle) / angle
        cosine = wp.cos(0.5 * angle)
    return wp.quat(scale * r[0], scale * r[1], scale * r[2], cosine)


@wp.func
def nearest_turn(angle: float, reference: float) -> float:
    """The angle (rad), shifted by whole turns to lie within pi of the reference."""
    return angle + wp.TAU * wp.round((reference - angle) / wp.TAU)


@wp.func
def quat_to_euler_xyz_near(q: wp.quat, reference: wp.vec3) -> wp.vec3:
    """Of all intrinsic XYZ angles of a rotation, those nearest to the reference angles (rad).

    Every rotation has two triples, ``(x, y, z)`` and ``(x + pi, pi - y, z + pi)``, each up to whole turns.
    """
    e = quat_to_euler_xyz(q)
    near = wp.vec3(nearest_turn(e[0], reference[0]), nearest_turn(e[1], reference[1]), nearest_turn(e[2], reference[2]))
    flipped = wp.vec3(
        nearest_turn(e[0] + wp.PI, reference[0]),
        nearest_turn(wp.PI - e[1], reference[1]),
        nearest_turn(e[2] + wp.PI, reference[2]),
    )
    if wp.length_sq(flipped - reference) < wp.length_sq(near - reference):
        return flipped
    return near
