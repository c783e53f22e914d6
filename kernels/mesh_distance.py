"""Signed distances of points, such as those of a hand's surface, from the surfaces of an object's parts.

Negative inside. Inside is where the surface's winding number exceeds a half: a measure that holes, doubled faces and
parts that overlap hardly disturb, see ``tools/compare_mesh_signs.py``.

The search for the closest point is not differentiated, and need not be: the gradient of a signed distance is the unit
vector that leads away from the closest point. `find_closest_points` keeps that vector and `signed_distances` applies
it, so that running backwards searches nothing. Where several surface points are equally close (on the medial axis of
a part, and on its surface along sharp edges) the gradient jumps; one of its limits is taken.

All arrays are indexed ``[world, hand, point, part]``; a world's meshes are those of its own object.
"""

import warp as wp

SURFACE_THICKNESS = wp.constant(1.0e-5)
"""Nearer to a surface than this [m] the direction to the closest point is rounding noise."""
EDGE_WIDTH = wp.constant(1.0e-4)
"""Barycentric coordinate from which on a point counts as inside its triangle, not on an edge."""


@wp.struct
class SurfacePoint:
    """The point of a surface that is closest to a given one, in the frame of the mesh.

    Attributes:
        position: where it is, m; the given point itself if none is within reach.
        normal: unit gradient of the signed distance at the given point; zero if none is within reach.
    """

    position: wp.vec3
    normal: wp.vec3


@wp.struct
class HandPoints:
    """Points that move with the links of each hand, with balls around them.

    Attributes:
        position: [H, P] centres in the frames of their links, m.
        radius: [H, P] m.
        link: [H, P] int, ascending.
        first: [H, 17] int, where each link's points start, and where the last one's end.
    """

    position: wp.array2d[wp.vec3]
    radius: wp.array2d[float]
    link: wp.array2d[int]
    first: wp.array2d[int]


@wp.func
def closest_surface_point(mesh: wp.uint64, point: wp.vec3, reach: float) -> SurfacePoint:
    """The closest point of a mesh, which must have been made with ``support_winding_number``.

    Args:
        mesh: id of the mesh.
        point: in the frame of the mesh, m.
        reach: how far to search, m.
    """
    closest = SurfacePoint()
    closest.position = point
    query = wp.mesh_query_point_sign_winding_number(mesh, point, reach)
    if query.result:
        closest.position = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
        outwards = query.sign * (point - closest.position)
        distance = wp.length(outwards)
        least = wp.min(wp.min(query.u, query.v), 1.0 - query.u - query.v)
        if least > EDGE_WIDTH or distance < SURFACE_THICKNESS:
            # More exact than the direction between two points that are near each other.
            closest.normal = wp.mesh_eval_face_normal(mesh, query.face)
            if wp.dot(closest.normal, outwards) < -SURFACE_THICKNESS:
                closest.normal = -closest.normal
        else:
            closest.normal = outwards / distance
    return closest


@wp.kernel
def place_points(link_pose: wp.array3d[wp.transform], points: HandPoints, position: wp.array3d[wp.vec3]):
    """Centres of the points of posed hands, [W, H, P], in the frame of the link poses [W, H, 16].

    Launch with ``dim=(W, H, P)``. Differentiable in ``link_pose``.
    """
    world, hand, point = wp.tid()
    pose = link_pose[world, hand, points.link[hand, point]]
    position[world, hand, point] = wp.transform_point(pose, points.position[hand, point])


@wp.kernel(enable_backward=False)
def find_closest_points(
    mesh: wp.array2d[wp.uint64],
    part_pose: wp.array2d[wp.transform],
    position: wp.array3d[wp.vec3],
    reach: float,
    closest: wp.array4d[wp.vec3],
    normal: wp.array4d[wp.vec3],
):
    """For every point the closest one on each part.

    Launch with ``dim=(W, H, P, 2)`` and, under a tape, ``record_tape=False``.

    Args:
        mesh: [W, 2] ids of the parts' meshes.
        part_pose: [W, 2] frames of the parts.
        position: [W, H, P] points, in the frame that the part poses are given in, m.
        reach: how far to search, m.
        closest: [W, H, P, 2] output, the closest surface points in the part's frame, m.
        normal: [W, H, P, 2] output, gradients of the signed distances in the part's frame; zero out of reach.
    """
    world, hand, point, part = wp.tid()
    in_part = wp.transform_point(wp.transform_inverse(part_pose[world, part]), position[world, hand, point])
    found = closest_surface_point(mesh[world, part], in_part, reach)
    closest[world, hand, point, part] = found.position
    normal[world, hand, point, part] = found.normal


@wp.kernel
def signed_distances(
    part_pose: wp.array2d[wp.transform],
    position: wp.array3d[wp.vec3],
    radius: wp.array2d[float],
    closest: wp.array4d[wp.vec3],
    normal: wp.array4d[wp.vec3],
    reach: float,
    distance: wp.array4d[float],
):
    """Signed distances of balls from the parts, from what `find_closest_points` found.

    Launch with ``dim=(W, H, P, 2)``. Differentiable in ``position`` and ``part_pose``.

    Args:
        part_pose, position, closest, normal, reach: as for `find_closest_points`.
        radius: [H, P] radii of the balls, m.
        distance: [W, H, P, 2] output, from the surface of the ball to that of the part, negative where they overlap,
            m; no more than ``reach`` less the radius.
    """
    world, hand, point, part = wp.tid()
    in_part = wp.transform_point(wp.transform_inverse(part_pose[world, part]), position[world, hand, point])
    direction = normal[world, hand, point, part]
    from_centre = reach
    if wp.length_sq(direction) > 0.0:
        from_centre = wp.dot(direction, in_part - closest[world, hand, point, part])
    distance[world, hand, point, part] = from_centre - radius[hand, point]


@wp.kernel(enable_backward=False)
def nearest_of_link(
    points: HandPoints,
    distance: wp.array4d[float],
    nearest: wp.array4d[int],
    link_distance: wp.array4d[float],
):
    """The point of each link that is nearest to each part, or deepest in it, and its signed distance [m].

    Launch with ``dim=(W, H, 16, 2)`` and, under a tape, ``record_tape=False``; gradients go through
    ``distance[world, hand, nearest, part]``.
    """
    world, hand, link, part = wp.tid()
    best = points.first[hand, link]
    for point in range(points.first[hand, link] + 1, points.first[hand, link + 1]):
        if distance[world, hand, point, part] < distance[world, hand, best, part]:
            best = point
    nearest[world, hand, link, part] = best
    link_distance[world, hand, link, part] = distance[world, hand, best, part]
