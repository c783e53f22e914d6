"""Pictures of surfaces, made by Warp on the CPU: no display, no graphics driver."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.arrays import Array
from artigrasp.export.camera import View
from artigrasp.export.surface import Surface
from artigrasp.kernels import raycast

BACKGROUND = (0.97, 0.98, 1.0)
"""Linear RGB of the floor and of everything behind it."""
GHOST = (0.10, 0.42, 0.22)
"""Linear RGB of a ghost."""
SUN_RAYS, SKY_RAYS = 6, 16
"""Rays of light per row of samples in a pixel: towards the key light and into the surroundings."""
SHOULDER = 0.75
"""Linear value above which light is compressed."""

_DEVICE = "cpu"
_BAND = 16
"""Rows that a thread renders at a time."""


def render_surface(
    surface: Surface,
    colours: NDArray[np.floating],
    view: View,
    *,
    width: int,
    height: int,
    grid: int = 2,
    ghost: Surface | None = None,
    transparent: bool = False,
) -> NDArray[np.uint8]:
    """Render one image.

    Args:
        surface: What is seen, world [m].
        colours: Linear RGB of its faces, shape ``[F, 3]``.
        view: The camera and the light.
        width: Of the image [px].
        height: Of the image [px].
        grid: A pixel is the mean of ``grid`` by ``grid`` samples.
        ghost: What is seen through and has no shadow, world [m].
        transparent: Whether to leave out the background, but for the shadow on the floor.

    Returns:
        sRGB, shape ``[height, width, 3]``, or with opacity, shape ``[height, width, 4]``, if transparent.
    """
    mesh, ghost_mesh = _mesh(surface), None if ghost is None else _mesh(ghost)
    scene = raycast.Scene()
    scene.mesh = mesh.id
    scene.corner_normals = _vectors(surface.corner_normals.reshape(-1, 3))
    scene.colours = _vectors(colours)
    scene.sun = wp.vec3(*view.sun)
    scene.background = wp.vec3(*BACKGROUND)
    scene.sun_samples, scene.sky_samples = (-(-rays // grid) for rays in (SUN_RAYS, SKY_RAYS))
    scene.transparent = int(transparent)
    scene.ghost = wp.uint64(0) if ghost_mesh is None else ghost_mesh.id
    scene.ghost_colour = wp.vec3(*GHOST)
    camera = raycast.Camera()
    for name in ("position", "forward", "right", "up"):
        setattr(camera, name, wp.vec3(*getattr(view, name)))
    image = wp.zeros((height, width), dtype=wp.vec4, device=_DEVICE)

    def render_band(first_row: int) -> None:
        wp.launch(
            raycast.render,
            dim=(min(_BAND, height - first_row), width),
            inputs=[scene, camera, first_row, grid],
            outputs=[image],
            device=_DEVICE,
        )

    # Warp runs a kernel on one core and lets go of Python's lock meanwhile. The first launch also compiles.
    render_band(0)
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(render_band, range(_BAND, height, _BAND)))
    light, cover = np.split(image.numpy(), [3], axis=-1)
    if not transparent:
        return tone_mapped(light)
    opacity = np.round(255 * cover).astype(np.uint8)
    return np.concatenate([tone_mapped(light / np.maximum(cover, 1e-6)), opacity], axis=-1)


def visibility(scene: Surface, points: Array, normals: Array, directions: Array) -> Array:
    """How squarely points of a scene are seen from far away.

    Args:
        scene: All that may hide them, world [m].
        points: On its surface, world [m], shape ``[N, 3]``.
        normals: Unit normals there, shape ``[N, 3]``.
        directions: Unit vectors from the scene to who looks, shape ``[D, 3]``.

    Returns:
        The cosine of the slant, 0 for hidden points, shape ``[D, N]``.
    """
    mesh = _mesh(scene)
    seen = wp.zeros((len(directions), len(points)), dtype=float, device=_DEVICE)
    wp.launch(
        raycast.see,
        dim=seen.shape,
        inputs=[mesh.id, _vectors(points), _vectors(normals), _vectors(directions)],
        outputs=[seen],
        device=_DEVICE,
    )
    return np.asarray(seen.numpy(), np.float64)


def tone_mapped(linear: ArrayLike) -> NDArray[np.uint8]:
    """SRGB bytes of linear values, the bright ones compressed so that they keep their colour, shape ``[..., 3]``."""
    light = np.asarray(linear)
    room = 1 - SHOULDER
    return encode_srgb(np.where(light > SHOULDER, SHOULDER + room * (1 - np.exp((SHOULDER - light) / room)), light))


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """SRGB bytes of linear values from 0 to 1, same shape."""
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)


def _mesh(surface: Surface) -> wp.Mesh:
    return wp.Mesh(_vectors(surface.vertices), wp.array(surface.faces.ravel(), dtype=int, device=_DEVICE))


def _vectors(values: NDArray[np.floating]) -> wp.array:
    return wp.array(np.ascontiguousarray(values, np.float32), dtype=wp.vec3, device=_DEVICE)
