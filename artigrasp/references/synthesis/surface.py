"""The points of an object's surface that fingers can come to."""

from dataclasses import dataclass

import numpy as np
import trimesh
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.kernels.layout import ARTICULATED
from artigrasp.kernels.visibility import count_free_rays
from artigrasp.references.hand_distance import pose_parts_in_base
from artigrasp.references.synthesis.grip import RestingObject

STANDOFF = 0.012
"""Where the middle of a fingertip is that touches a point, over the surface [m]."""
CLEARANCE = 0.55
"""How near to another point of the surface it may be there, over the standoff."""
REACH = 0.3
"""How far a way out must be free [m]."""
LEAST_OPENNESS = 0.08
"""Share of all directions from which a fingertip must be able to come."""
FRICTION = 0.8
"""Coefficient of friction by which contacts are judged before the physics does."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """N points that fingers can come to, in the base's frame, uniform over the surface.

    Attributes:
        position: [m], shape (N, 3).
        normal: Unit outward normal, shape (N, 3).
        part: Index of the part, shape (N,).
        opening: How well a finger opens the object there, as far from the hinge as possible and along the way that the
            part moves, at most about 1; 0 on the base, shape (N,).
    """

    position: Array
    normal: Array
    part: NDArray[np.int64]
    opening: Array


def sample_surface(resting: RestingObject, count: int, seed: int, device: str = "cpu") -> SurfacePoints:
    """Draw points of the surface, and leave out what no finger can come to.

    Args:
        resting: The object.
        count: Points that are drawn.
        seed: Of the draw.
        device: Warp device.
    """
    poses = pose_parts_in_base(resting.model, np.array([resting.angle]))[0].astype(np.float64)
    meshes = []
    for part, pose in zip(resting.model.parts, poses, strict=True):
        vertices = Rotation.from_quat(pose[3:]).apply(part.vertices) + pose[:3]
        meshes.append(trimesh.Trimesh(vertices, part.faces, process=False))
    whole: trimesh.Trimesh = trimesh.util.concatenate(meshes)  # type: ignore[assignment]
    position, face = trimesh.sample.sample_surface(whole, count, seed=seed)
    normal = np.asarray(whole.face_normals)[face]
    part = (face >= len(meshes[0].faces)).astype(np.int64)
    open_enough = _openness(whole, position + STANDOFF * normal, resting, device) >= LEAST_OPENNESS
    position, normal, part = position[open_enough], normal[open_enough], part[open_enough]
    return SurfacePoints(position, normal, part, _opening(position, normal, part, resting))


def _openness(whole: trimesh.Trimesh, points: Array, resting: RestingObject, device: str) -> Array:
    """Share of all directions in which the way out is free, shape [N]."""
    directions = trimesh.creation.icosphere(subdivisions=2).vertices
    mesh = wp.Mesh(
        wp.array(whole.vertices.astype(np.float32), dtype=wp.vec3, device=device),
        wp.array(whole.faces.astype(np.int32).ravel(), dtype=int, device=device),
        support_winding_number=True,
    )
    free = wp.zeros(len(points), dtype=int, device=device)
    wp.launch(
        count_free_rays,
        dim=len(points),
        inputs=[
            mesh.id,
            wp.array(points.astype(np.float32), dtype=wp.vec3, device=device),
            wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device),
            wp.vec3(*resting.up),
            resting.floor,
            CLEARANCE * STANDOFF,
            REACH,
        ],
        outputs=[free],
        device=device,
    )
    return np.asarray(free.numpy() / len(directions))


def _opening(position: Array, normal: Array, part: NDArray[np.int64], resting: RestingObject) -> Array:
    motion, arm = resting.opening_direction(position)
    slant = np.einsum("ni,ni->n", normal, motion)
    # Of the forces that a finger can press with, the one that has most along the way.
    along = np.maximum(-slant + FRICTION * np.sqrt(np.maximum(1 - slant**2, 0)), 0)
    return np.where(part == ARTICULATED, along * arm / resting.lever, 0.0)
