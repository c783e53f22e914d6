"""Compare Warp's ways to tell the inside of a mesh from its outside with the exact winding number.

    python tools/compare_mesh_signs.py [OBJECT ...]

prints for each part of each object (all by default) how many edges are not shared by two faces, the share of points
where a finger might be that are inside (winding number over 1/2, summed in double precision over all triangles), and
the share on whose side each of Warp's four queries disagrees. `kernels/mesh_distance.py` uses the winding number.
"""

import argparse

import numpy as np
import trimesh
import warp as wp

from artigrasp.arrays import Array
from artigrasp.assets.holes import open_edges
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import load_object
from artigrasp.assets.object_model import Mesh
from artigrasp.kernels.layout import PARTS

POINT_COUNT, SPREAD = 4000, 0.008
"""Points per part, and how far they are from its surface, one standard deviation in each direction [m]."""
QUERIES = ("closest hit of three rays", "parity of three rays", "pseudo-normal", "winding number")


@wp.kernel(enable_backward=False)
def query_signs(mesh: wp.uint64, point: wp.array[wp.vec3], sign: wp.array2d[float]):
    """Signs [N, 4] by each of the queries."""
    index = wp.tid()
    reach = 1.0
    rays = wp.mesh_query_point(mesh, point[index], reach)
    parity = wp.mesh_query_point_sign_parity(mesh, point[index], reach, 3)
    normal = wp.mesh_query_point_sign_normal(mesh, point[index], reach)
    winding = wp.mesh_query_point_sign_winding_number(mesh, point[index], reach)
    sign[index, 0] = rays.sign
    sign[index, 1] = parity.sign
    sign[index, 2] = normal.sign
    sign[index, 3] = winding.sign


def winding_number(triangles: Array, point: Array) -> float:
    """How often a surface [F, 3, 3] goes around a point, by the solid angles of its triangles."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(edge, axis=1) for edge in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2 * np.arctan2(volume, cosines).sum() / (4 * np.pi))


def compare(mesh: Mesh) -> tuple[float, Array]:
    """Share of points inside, and shares on which the queries disagree with the exact winding number."""
    on_surface, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), POINT_COUNT, seed=0
    )
    points = (on_surface + np.random.default_rng(0).normal(0, SPREAD, on_surface.shape)).astype(np.float32)
    inside = np.array([winding_number(mesh.vertices[mesh.faces], point) > 0.5 for point in points.astype(float)])
    on_device = wp.Mesh(
        wp.array(mesh.vertices, dtype=wp.vec3), wp.array(mesh.faces.ravel(), dtype=int), support_winding_number=True
    )
    sign = wp.zeros((POINT_COUNT, len(QUERIES)), dtype=float)
    wp.launch(query_signs, dim=POINT_COUNT, inputs=[on_device.id, wp.array(points, dtype=wp.vec3)], outputs=[sign])
    return float(inside.mean()), ((sign.numpy() < 0) != inside[:, None]).mean(axis=0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Compare ways to tell the inside of a mesh.")
    parser.add_argument("objects", nargs="*", help="all by default")
    names = parser.parse_args().objects or list_assets("objects")
    print("object", "part", "open edges", "inside", *QUERIES, sep=" | ")
    worst = np.zeros(len(QUERIES))
    for name in names:
        for part, model in zip(PARTS, load_object(name).parts, strict=True):
            mesh = Mesh(model.vertices, model.faces)
            inside, wrong = compare(mesh)
            worst = np.maximum(worst, wrong)
            print(name, part, open_edges(mesh), f"{inside:.3f}", *(f"{share:.4f}" for share in wrong), sep=" | ")
    print("worst", "", "", "", *(f"{share:.4f}" for share in worst), sep=" | ")


if __name__ == "__main__":
    main()
