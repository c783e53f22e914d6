"""A small ray caster: a triangle mesh on an endless studio floor, in daylight.

One key light with soft shadows, a sky that is brighter above than below, and one bounce of coloured light. The floor
shows nothing but what the mesh takes from its light, so it melts into the background, or is nothing but a shadow where
that is transparent. A second mesh may stand in the picture as a ghost: seen through, and without shadow.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 1})

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
GHOST_OPACITY, GHOST_RIM = wp.constant(0.38), wp.constant(0.40)
"""Opacity of a ghost where its surface faces the camera, and how much is added where it turns away."""
GHOST_GAP = wp.constant(1.0e-3)
"""A ghost that is not this much nearer than the mesh coincides with it, and is not seen [m]."""
FADE = wp.constant(0.2)
"""Share of half the image, at each border, within which shadows on the floor fade away."""
SHADOW_GAMMA = wp.constant(0.4545)
"""Programs blend a transparent picture's shadow with what is behind it in encoded values, not in linear ones."""


@wp.struct
class Scene:
    """What is looked at.

    Attributes:
        mesh: id of the ``wp.Mesh``, world frame.
        corner_normals: [3 F] unit normals at the corners of the triangles, world frame.
        colours: [F] linear RGB of the triangles.
        sun: unit vector towards the key light, world frame.
        background: linear RGB of the floor and of everything behind it.
        sun_samples: shadow rays per sample of a pixel.
        sky_samples: rays into the surroundings per sample of a pixel.
        transparent: 1 if there is no background but the shadow on the floor, else 0.
        ghost: id of the ``wp.Mesh`` that is a ghost, world frame; 0 for none.
        ghost_colour: linear RGB of it.
    """

    mesh: wp.uint64
    corner_normals: wp.array[wp.vec3]
    colours: wp.array[wp.vec3]
    sun: wp.vec3
    background: wp.vec3
    sun_samples: int
    sky_samples: int
    transparent: int
    ghost: wp.uint64
    ghost_colour: wp.vec3


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
def gradient_noise(column: float, row: float) -> float:
    """A number from 0 to 1 for each pixel such that those of neighbours are far apart (Jimenez 2014)."""
    return wp.frac(52.9829189 * wp.frac(0.06711056 * column + 0.00583715 * row))


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
    for k in range(scene.sun_samples):
        index = float(first * scene.sun_samples + k)
        radius = wp.sqrt(wp.frac((index + 0.5) / float(count * scene.sun_samples) + shift[0]))
        direction = direction_around(scene.sun, wp.sin(SUN_RADIUS) * radius, wp.frac(index * GOLDEN + shift[1]))
        slant = wp.dot(direction, normal)
        if slant <= 0.0:
            continue
        if not wp.mesh_query_ray_anyhit(scene.mesh, point, direction, 10.0):
            light += slant
    return light / float(scene.sun_samples)


@wp.func
def skylight(scene: Scene, point: wp.vec3, normal: wp.vec3, first: int, count: int, shift: wp.vec2) -> wp.vec3:
    """Mean light from the surroundings, what bounces off the mesh included."""
    light = wp.vec3()
    for k in range(scene.sky_samples):
        index = float(first * scene.sky_samples + k)
        radius = wp.sqrt(wp.frac((index + 0.5) / float(count * scene.sky_samples) + shift[0]))
        direction = direction_around(normal, radius, wp.frac(index * GOLDEN + shift[1]))
        hit = wp.mesh_query_ray(scene.mesh, point, direction, SKY_REACH)
        if hit.result:
            nearness = 1.0 - hit.t / SKY_REACH
            bounce = wp.cw_mul(scene.colours[hit.face], wp.vec3(0.45, 0.45, 0.45))
            light += wp.lerp(sky(direction), bounce, nearness)
        else:
            light += sky(direction)
    return light / float(scene.sky_samples)


@wp.func
def surface_light(
    scene: Scene, point: wp.vec3, normal: wp.vec3, face: int, direction: wp.vec3, first: int, count: int, shift: wp.vec2
) -> wp.vec3:
    """Light that a point of the mesh sends back along ``direction``."""
    sun = sunlight(scene, point, normal, first, count, shift)
    light = sun * SUN_COLOUR + skylight(scene, point, normal, first, count, shift)
    half = wp.normalize(scene.sun - direction)
    shine = GLOSS * wp.pow(wp.max(wp.dot(half, normal), 0.0), GLOSS_EXPONENT)
    # Skin and plastic reflect more at grazing angles.
    rim = 0.10 * wp.pow(1.0 - wp.abs(wp.dot(normal, direction)), 4.0)
    return wp.cw_mul(scene.colours[face], light) + sun * shine * SUN_COLOUR + rim * ZENITH_COLOUR


@wp.func
def floor_light(scene: Scene, point: wp.vec3, first: int, count: int, shift: wp.vec2) -> wp.vec3:
    """Light that arrives at a point of the floor, as a share of what would without the mesh."""
    up = wp.vec3(0.0, 0.0, 1.0)
    light = sunlight(scene, point, up, first, count, shift) * SUN_COLOUR
    light += skylight(scene, point, up, first, count, shift)
    # Without anything above the floor: its sky is the mean over the hemisphere.
    whole = scene.sun[2] * SUN_COLOUR + wp.lerp(NADIR_COLOUR, ZENITH_COLOUR, 5.0 / 6.0)
    return wp.cw_div(light, whole)


@wp.func
def through_ghost(scene: Scene, origin: wp.vec3, direction: wp.vec3, distance: float, behind: wp.vec4) -> wp.vec4:
    """What is seen where the ghost may be in front of something at a distance."""
    if scene.ghost == wp.uint64(0):
        return behind
    hit = wp.mesh_query_ray(scene.ghost, origin, direction, distance - GHOST_GAP)
    if not hit.result:
        return behind
    facing = wp.abs(wp.dot(hit.normal, direction))
    opacity = GHOST_OPACITY + GHOST_RIM * wp.pow(1.0 - facing, 3.0)
    colour = (0.8 + 0.4 * facing) * scene.ghost_colour
    return opacity * wp.vec4(colour[0], colour[1], colour[2], 1.0) + (1.0 - opacity) * behind


@wp.func
def radiance(
    scene: Scene, origin: wp.vec3, direction: wp.vec3, shadow: float, first: int, count: int, shift: wp.vec2
) -> wp.vec4:
    """Light that comes to ``origin`` out of ``direction``, and how much of what is behind it is covered.

    Shadows on the floor are as strong as ``shadow``, 0 to 1.
    """
    distance = wp.float32(100.0)
    hit = wp.mesh_query_ray(scene.mesh, origin, direction, distance)
    floor = wp.float32(-1.0)
    if direction[2] < 0.0:
        floor = -origin[2] / direction[2]
    light = scene.background
    cover = wp.float32(1.0)
    if hit.result and (floor < 0.0 or hit.t < floor):
        distance = hit.t
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
        light = surface_light(scene, point, normal, hit.face, direction, first, count, shift)
    else:
        share = wp.vec3(1.0, 1.0, 1.0)
        if floor > 0.0 and shadow > 0.0:
            distance = floor
            point = origin + floor * direction + wp.vec3(0.0, 0.0, OFFSET)
            share = wp.lerp(share, floor_light(scene, point, first, count, shift), shadow)
        light = wp.cw_mul(scene.background, share)
        if scene.transparent != 0:
            light = wp.vec3()
            mean = wp.clamp((share[0] + share[1] + share[2]) / 3.0, 0.0, 1.0)
            cover = 1.0 - wp.pow(mean, SHADOW_GAMMA)
    return through_ghost(scene, origin, direction, distance, wp.vec4(light[0], light[1], light[2], cover))


@wp.kernel
def render(
    scene: Scene,
    camera: Camera,
    first_row: int,
    grid: int,
    # outputs
    image: wp.array2d[wp.vec4],
):
    """Linear RGB of an image, multiplied with the fourth number, which is how much of the background is covered.

    Launch with ``dim=(rows, width)``; rows from ``first_row`` on are written. A pixel is the mean of ``grid`` by
    ``grid`` samples.
    """
    row, column = wp.tid()
    row += first_row
    height, width = image.shape[0], image.shape[1]
    shift = wp.vec2(gradient_noise(float(column), float(row)), gradient_noise(float(column) + 47.0, float(row) + 17.0))
    colour = wp.vec4()
    count = grid * grid
    for sample in range(count):
        x = (float(column) + (float(sample % grid) + 0.5) / float(grid)) / float(width)
        y = (float(row) + (float(sample // grid) + 0.5) / float(grid)) / float(height)
        direction = wp.normalize(camera.forward + (2.0 * x - 1.0) * camera.right + (1.0 - 2.0 * y) * camera.up)
        to_border = 0.5 - wp.max(wp.abs(x - 0.5), wp.abs(y - 0.5))
        shadow = wp.smoothstep(0.0, 0.5 * FADE, to_border)
        colour += radiance(scene, camera.position, direction, shadow, sample, count, shift)
    image[row, column] = colour / float(count)


@wp.kernel
def see(
    mesh: wp.uint64,
    points: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    # outputs
    seen: wp.array2d[float],
):
    """How squarely points of a surface are seen from far away: the cosine of the slant, 0 for those that are hidden.

    Launch with ``dim=(directions, points)``. The directions are unit vectors from the surface to who looks.
    """
    view, point = wp.tid()
    direction = directions[view]
    facing = wp.dot(normals[point], direction)
    if facing > 0.0 and not wp.mesh_query_ray_anyhit(mesh, points[point] + OFFSET * normals[point], direction, 10.0):
        seen[view, point] = facing
