"""From how many sides points near an object are seen."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def count_free_rays(
    mesh: wp.uint64,
    position: wp.array[wp.vec3],
    direction: wp.array[wp.vec3],
    up: wp.vec3,
    floor: float,
    reach: float,
    free: wp.array[int],
):
    """Count the directions in which nothing is in the way of each point: no surface, and not the table.

    Launch with ``dim=(N, D)``; ``free`` must be zero.

    Args:
        mesh: id of the ``wp.Mesh`` of the object.
        position: [N] points, in the frame of the mesh, m.
        direction: [D] unit vectors.
        up: unit vector away from the table.
        floor: height of the table along it, m.
        reach: how far to look, m.
        free: [N] int, output.
    """
    point, index = wp.tid()
    origin, along = position[point], direction[index]
    height = wp.dot(up, origin) - floor
    over_table = height > 0.0 and height + reach * wp.dot(up, along) > 0.0
    if over_table and not wp.mesh_query_ray_anyhit(mesh, origin, along, reach):
        wp.atomic_add(free, point, 1)
