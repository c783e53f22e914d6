"""From how many sides points near an object are seen."""

import warp as wp

from .mesh_distance import closest_surface_point

wp.set_module_options({"enable_backward": False})


@wp.kernel
def count_free_rays(
    mesh: wp.uint64,
    position: wp.array[wp.vec3],
    direction: wp.array[wp.vec3],
    up: wp.vec3,
    floor: float,
    clearance: float,
    reach: float,
    free: wp.array[int],
):
    """Count the directions in which nothing is in the way of each point: no surface, and not the table.

    A point that is too near to the surface, or inside, has none. Launch with ``dim=N``.

    Args:
        mesh: id of the ``wp.Mesh`` of the object, which must have been made with ``support_winding_number``.
        position: [N] points, in the frame of the mesh, m.
        direction: [D] unit vectors.
        up: unit vector away from the table.
        floor: height of the table along it, m.
        clearance: least distance of a point from the surface, m.
        reach: how far to look, m.
        free: [N] int, output.
    """
    point = wp.tid()
    origin = position[point]
    height = wp.dot(up, origin) - floor
    crowded = wp.length_sq(closest_surface_point(mesh, origin, clearance).normal) > 0.0
    count = wp.int32(0)
    if height > 0.0 and not crowded:
        for index in range(direction.shape[0]):
            along = direction[index]
            over_table = height + reach * wp.dot(up, along) > 0.0
            if over_table and not wp.mesh_query_ray_anyhit(mesh, origin, along, reach):
                count += 1
    free[point] = count
