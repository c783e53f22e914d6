"""MANO's parameters of a hand and ours: the same links in the same order, turned by rotation vectors instead of angles.

A hand of MANO's has a translation and 16 rotation vectors, of the wrist in the world and of 15 finger joints in their
parents. Here the finger joints' hold the whole turn from the flat hand; files often leave the mean pose out.
"""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import Array

WRIST_FROM_MANO = {"right": np.array([0.09566994, 0.00638343, 0.0061863])}
WRIST_FROM_MANO["left"] = WRIST_FROM_MANO["right"] * [-1, 1, 1]
"""MANO's wrist joint for the mean shape, about which a hand turns, from MANO's translation [m]."""


def wrist_pose(rotation: Array, translation: Array, side: str) -> RigidTransform:
    """Wrist frames from MANO's rotation vectors [rad] and MANO's translations [m], both of shape (..., 3)."""
    return RigidTransform.from_components(translation + WRIST_FROM_MANO[side], Rotation.from_rotvec(rotation))


def finger_angles(rotation_vectors: Array) -> Array:
    """Intrinsic XYZ angles [rad] of rotation vectors of the finger joints, mean pose included, both (..., 45)."""
    angles: Array = Rotation.from_rotvec(rotation_vectors.reshape(-1, 3)).as_euler("XYZ")
    return angles.reshape(rotation_vectors.shape)


def mano_translation(wrist_position: Array, side: str) -> Array:
    """MANO's translations [m] of hands whose wrists are there, both of shape (..., 3)."""
    return np.asarray(wrist_position - WRIST_FROM_MANO[side])


def rotation_vectors(angles: Array) -> Array:
    """Rotation vectors of the finger joints, mean pose included, of intrinsic XYZ angles, both [rad] and (..., 45)."""
    vectors: Array = Rotation.from_euler("XYZ", angles.reshape(-1, 3)).as_rotvec()
    return vectors.reshape(angles.shape)
