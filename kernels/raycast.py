"""A small ray caster: a triangle mesh on an endless studio floor, in daylight.

One key light with soft shadows, a sky that is brighter above than below, and one bounce of coloured light. The floor
shows nothing but what the mesh takes from its light, so it melts into the background.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 1})

SUN_SAMPLES = wp.constant(6)
"""Shadow rays per sample of a pixel."""
SKY_SAMPLES = wp.constant(16)
"""Rays into the surroundings per sample of a pixel."""
SKY_REACH = wp.constant(0.5)
"""What is farther away than this takes no light of the sky [m]."""
SUN_RADIUS = wp.constant(0.08)
"""Half the angle under which the key light appears [rad]: how soft its shadows are."""
SUN_COLOUR = wp.constant(wp.vec3(1.25, 1.18, 1.08))
ZENITH_COLOUR = wp.constant(wp.vec3(0.50, 0.55, 0.62))
NADIR_COLOUR = wp.constant(wp.vec3(0.40, 0.385, 0.37))
GLOSS, GLOSS_EXPONENT = wp.constant(0.05), wp.constant(28.0)
OFFSET = wp.constant(2.0e-4)
"""Distance from a surface at which rays that leave it start [m]."""
GOLDEN = wp.constant(0.61803399)


@wp.struct
class Scene:
    """What is looked at.

    Attributes:
        mesh: id of the ``wp.Mesh``, world frame.
        corner_normals: [3 F] unit normals at the corners of the triangles, world frame.
        colours: [F] linear RGB of the triangles.
        sun: unit vector towards the key light, world frame.
    """

    mesh: wp.uint64
    corner_normals: wp.array[wp.vec3]
    colours: wp.array[wp.vec3]
    sun: wp.vec3


@wp.struct
class Camera:
    """Who looks.

    Attributes:
        position: world frame, m.
        forward: unit vector along the line of sight, world frame.
        right, up: vectors from the middle of the image to its right and upper edge at unit distance, world frame.
    """

    position: wp.vec3
    forward: wp.vec3
    right: wp.vec3
    up: wp.vec3


@wp.func
def direction_around(axis: wp.vec3, radius: float, turn: float) -> wp.vec3:
    """The unit vector above the point at ``radius`` (0 to 1) and ``turn`` (rounds) on the unit disc across ``axis``."""
    side = wp.vec3(1.0, 0.0, 0.0)
    if wp.abs(axis[0]) > 0.7:
        side = wp.vec3(0.0, 1.0, 0.0)
    u = wp.normalize(wp.cross(axis, side))
    v = wp.cross(axis, u)
    angle = wp.TAU * turn
    height = wp.sqrt(wp.max(0.0, 1.0 - radius * radius))
    return wp.normalize(radius * (wp.cos(angle) * u + wp.sin(angle) * v) + height * axis)


@wp.func
def sky(direction: wp.vec3) -> wp.vec3:
    """Light from a direction in which there is nothing."""
    return wp.lerp(NADIR_COLOUR, ZENITH_COLOUR, 0.5 + 0.5 * direction[2])


@wp.func
def sunlight(scene: Scene, point: wp.vec3, normal: wp.vec3, first: int, count: int, shift: wp.vec2) -> float:
    """Share of the key light that arrives, times the cosine of its slant."""
    light = wp.float32(0.0)
    for k in range(SUN_SAMPLES):
        index = float(first * SUN_SAMPLES + k)
        radius = wp.sqrt(wp.frac((index + 0.5) / float(count * SUN_SAMPLES) + shift[0]))
        direction = direction_around(scene.sun, wp.sin(SUN_RADIUS) * radius, wp.frac(index * GOLDEN + shift[1]))
        slant = wp.dot(direction, normal)
        if slant <= 0.0:
            continue
        if not wp.mesh_query_ray_anyhit(scene.mesh, point, direction, 10.0):
            light += slant
    return light / float(SUN_SAMPLES)


@wp.func
def skylight(scene: Scene, point: wp.vec3, normal: wp.vec3, first: int, count: int, shift: wp.vec2) -> wp.vec3:
    """Mean light from the surroundings, what bounces off the mesh included."""
    light = wp.vec3()
    for k in range(SKY_SAMPLES):
        index = float(first * SKY_SAMPLES + k)
        radius = wp.sqrt(wp.frac((index + 0.5) / float(count * SKY_SAMPLES) + shift[0]))
        direction = direction_around(normal, radius, wp.frac(index * GOLDEN + shift[1]))
        hit = wp.mesh_query_ray(scene.mesh, point, direction, SKY_REACH)
        if hit.result:
            nearness = 1.0 - hit.t / SKY_REACH
            bounce = wp.cw_mul(scene.colours[hit.face], wp.vec3(0.45, 0.45, 0.45))
            light += wp.lerp(sky(direction), bounce, nearness)
        else:
            light += sky(direction)
    return light / float(SKY_SAMPLES)


@wp.func
def radiance(
    scene: Scene, origin: wp.vec3, direction: wp.vec3, background: wp.vec3, first: int, count: int, shift: wp.vec2
) -> wp.vec3:
    """Light that comes to ``origin`` out of ``direction``."""
    hit = wp.mesh_query_ray(scene.mesh, origin, direction, 100.0)
    floor = wp.float32(-1.0)
    if direction[2] < 0.0:
        floor = -origin[2] / direction[2]
    if hit.result and (floor < 0.0 or hit.t < floor):
        corner = 3 * hit.face
        w = 1.0 - hit.u - hit.v
        normal = wp.normalize(
            hit.u * scene.corner_normals[corner]
            + hit.v * scene.corner_normals[corner + 1]
            + w * scene.corner_normals[corner + 2]
        )
        if wp.dot(hit.normal, direction) > 0.0:
            normal = -normal
        point = origin + hit.t * direction + OFFSET * normal
        sun = sunlight(scene, point, normal, first, count, shift)
        light = sun * SUN_COLOUR + skylight(scene, point, normal, first, count, shift)
        half = wp.normalize(scene.sun - direction)
        shine = GLOSS * wp.pow(wp.max(wp.dot(half, normal), 0.0), GLOSS_EXPONENT)
        # Skin and plastic reflect more at grazing angles.
        rim = 0.10 * wp.pow(1.0 - wp.abs(wp.dot(normal, direction)), 4.0)
        return wp.cw_mul(scene.colours[hit.face], light) + sun * shine * SUN_COLOUR + rim * ZENITH_COLOUR
    if floor > 0.0:
        up = wp.vec3(0.0, 0.0, 1.0)
        point = origin + floor * direction + OFFSET * up
        light = sunlight(scene, point, up, first, count, shift) * SUN_COLOUR
        light += skylight(scene, point, up, first, count, shift)
        # Without anything above the floor: its sky is the mean over the hemisphere.
        whole = scene.sun[2] * SUN_COLOUR + wp.lerp(NADIR_COLOUR, ZENITH_COLOUR, 5.0 / 6.0)
        return wp.cw_mul(background, wp.cw_div(light, whole))
    return background


@wp.kernel
def render(
    scene: Scene,
    camera: Camera,
    background: wp.vec3,
    first_row: int,
    grid: int,
    # outputs
    image: wp.array2d[wp.vec3],
):
    """Linear RGB of an image.

    Launch with ``dim=(rows, width)``; rows from ``first_row`` on are written. A pixel is the mean of ``grid`` by
    ``grid`` samples.
    """
    row, column = wp.tid()
    row += first_row
    height, width = image.shape[0], image.shape[1]
    generator = wp.rand_init(1, row * width + column)
    shift = wp.vec2(wp.randf(generator), wp.randf(generator))
    colour = wp.vec3()
    count = grid * grid
    for sample in range(count):
        x = (float(column) + (float(sample % grid) + 0.5) / float(grid)) / float(width)
        y = (float(row) + (float(sample // grid) + 0.5) / float(grid)) / float(height)
        direction = wp.normalize(camera.forward + (2.0 * x - 1.0) * camera.right + (1.0 - 2.0 * y) * camera.up)
        colour += radiance(scene, camera.position, direction, background, sample, count, shift)
    image[row, column] = colour / float(count)
