"""Signed distances from triangle meshes in double precision, without any tree: every point against every triangle."""

import numpy as np
import trimesh

from artigrasp.assets.object import ObjectModel
from artigrasp.assets.object_model import Mesh


def winding_number(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How often a surface [F, 3, 3] goes around points [N, 3], by the solid angles of its triangles."""
    a, b, c = (triangles[None, :, corner] - points[:, None] for corner in range(3))
    la, lb, lc = (np.linalg.norm(edge, axis=-1) for edge in (a, b, c))
    volume = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
    cosines = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return 2 * np.arctan2(volume, cosines).sum(axis=1) / (4 * np.pi)


def signed_distance(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances [N] from the mesh, negative inside, and the closest points [N, 3]."""
    triangles = mesh.vertices[mesh.faces]
    count = len(triangles)
    # in millimetres, for trimesh takes triangles of a size of millimetres, in metres, for points
    closest = trimesh.triangles.closest_point(
        1000 * np.tile(triangles, (len(points), 1, 1)), 1000 * np.repeat(points, count, axis=0)
    ).reshape(len(points), count, 3)
    closest = closest / 1000
    distance = np.linalg.norm(closest - points[:, None], axis=-1)
    rows, best = np.arange(len(points)), distance.argmin(axis=1)
    sign = np.where(winding_number(triangles, points) > 0.5, -1.0, 1.0)
    return sign * distance[rows, best], closest[rows, best]


def surface(model: ObjectModel, part: int) -> Mesh:
    """The surface of a part."""
    return Mesh(model.parts[part].vertices, model.parts[part].faces)
