"""Conversions between quaternions, Euler angles and rotation vectors against SciPy."""

import numpy as np
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.kernels.rotations import (
    euler_xyz_to_quat,
    quat_to_euler_xyz,
    quat_to_euler_xyz_near,
    quat_to_rotation_vector,
    rotation_vector_to_quat,
)


@wp.kernel
def convert(
    angles: wp.array[wp.vec3],
    reference: wp.array[wp.vec3],
    quat: wp.array[wp.quat],
    euler: wp.array[wp.vec3],
    near: wp.array[wp.vec3],
    vector: wp.array[wp.vec3],
    again: wp.array[wp.quat],
):
    """Every conversion of each rotation."""
    i = wp.tid()
    q = euler_xyz_to_quat(angles[i][0], angles[i][1], angles[i][2])
    quat[i] = q
    euler[i] = quat_to_euler_xyz(q)
    near[i] = quat_to_euler_xyz_near(q, reference[i])
    vector[i] = quat_to_rotation_vector(q)
    again[i] = rotation_vector_to_quat(vector[i])


def converted(angles: np.ndarray, reference: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Outputs of the conversions of rotations given by intrinsic XYZ angles [N, 3]."""
    reference = np.zeros_like(angles) if reference is None else reference
    count = len(angles)
    outputs = {
        name: wp.zeros(count, dtype=wp.quat if name in ("quat", "again") else wp.vec3)
        for name in ("quat", "euler", "near", "vector", "again")
    }
    inputs = [wp.array(angles, dtype=wp.vec3), wp.array(reference, dtype=wp.vec3)]
    wp.launch(convert, dim=count, inputs=inputs, outputs=list(outputs.values()))
    return {name: array.numpy() for name, array in outputs.items()}


def random_angles(count: int = 200) -> np.ndarray:
    """Angles within a turn of zero."""
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (count, 3)).astype(np.float32)


def test_euler_angles_are_intrinsic_xyz() -> None:
    """R = Rx Ry Rz."""
    angles = random_angles()
    expected = Rotation.from_euler("XYZ", angles)
    assert (Rotation.from_quat(converted(angles)["quat"]) * expected.inv()).magnitude().max() < 1e-6


def test_euler_angles_of_a_rotation() -> None:
    """The angles give the rotation back, with the middle one in [-pi/2, pi/2]."""
    angles = random_angles()
    result = converted(angles)
    np.testing.assert_allclose(result["euler"], Rotation.from_euler("XYZ", angles).as_euler("XYZ"), atol=1e-4)


def test_rotation_vectors_are_the_shortest_ones() -> None:
    """Rotation vectors agree with SciPy's and lead back to the rotation."""
    angles = random_angles()
    result = converted(angles)
    expected = Rotation.from_euler("XYZ", angles)
    np.testing.assert_allclose(result["vector"], expected.as_rotvec(), atol=2e-5)
    assert (Rotation.from_quat(result["again"]) * expected.inv()).magnitude().max() < 2e-6


def test_small_rotations_keep_their_precision() -> None:
    """Around the switch to the series, angles of 1e-7 to 1e-1 rad come out right to 1e-6 of themselves."""
    size = np.logspace(-7, -1, 60)
    angles = np.zeros((60, 3), np.float32)
    angles[:, 1] = size
    np.testing.assert_allclose(converted(angles)["vector"][:, 1], angles[:, 1], rtol=1e-6)
    assert (converted(np.zeros((1, 3)))["vector"] == 0.0).all()


def test_nearest_euler_angles() -> None:
    """Angles that have wound around, or passed a right angle in the middle, are found again from close by."""
    rng = np.random.default_rng(1)
    angles = rng.uniform(-3.0 * np.pi, 3.0 * np.pi, (300, 3))
    # Away from the gimbal lock, where neighbouring rotations have distant angles.
    angles[:, 1] = np.where(np.abs(np.cos(angles[:, 1])) < 0.1, 0.3, angles[:, 1])
    reference = angles + rng.uniform(-0.2, 0.2, angles.shape)
    result = converted(angles.astype(np.float32), reference.astype(np.float32))
    np.testing.assert_allclose(result["near"], angles, atol=1e-4)
