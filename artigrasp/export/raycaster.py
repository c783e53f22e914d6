"""Pictures of surfaces, made by Warp on the CPU: no display, no graphics driver."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.export.camera import View
from artigrasp.export.surface import Surface
from artigrasp.kernels import raycast

BACKGROUND = (0.97, 0.98, 1.0)
"""Linear RGB of the floor and of everything behind it."""
SHOULDER = 0.75
"""Linear value above which light is compressed."""

_DEVICE = "cpu"
_BAND = 16
"""Rows that a thread renders at a time."""


def render_surface(
    surface: Surface, colours: NDArray[np.floating], view: View, *, width: int, height: int, grid: int = 2
) -> NDArray[np.uint8]:
    """Render one image.

    Args:
        surface: What is seen, world [m].
        colours: Linear RGB of its faces, shape ``[F, 3]``.
        view: The camera and the light.
        width: Of the image [px].
        height: Of the image [px].
        grid: A pixel is the mean of ``grid`` by ``grid`` samples.

    Returns:
        sRGB, shape ``[height, width, 3]``.
    """
    mesh = wp.Mesh(_vectors(surface.vertices), wp.array(surface.faces.ravel(), dtype=int, device=_DEVICE))
    scene = raycast.Scene()
    scene.mesh = mesh.id
    scene.corner_normals = _vectors(surface.corner_normals.reshape(-1, 3))
    scene.colours = _vectors(colours)
    scene.sun = wp.vec3(*view.sun)
    camera = raycast.Camera()
    for name in ("position", "forward", "right", "up"):
        setattr(camera, name, wp.vec3(*getattr(view, name)))
    image = wp.zeros((height, width), dtype=wp.vec3, device=_DEVICE)

    def render_band(first_row: int) -> None:
        wp.launch(
            raycast.render,
            dim=(min(_BAND, height - first_row), width),
            inputs=[scene, camera, wp.vec3(*BACKGROUND), first_row, grid],
            outputs=[image],
            device=_DEVICE,
        )

    # Warp runs a kernel on one core and lets go of Python's lock meanwhile. The first launch also compiles.
    render_band(0)
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(render_band, range(_BAND, height, _BAND)))
    return to_srgb(image.numpy())


def to_srgb(linear: ArrayLike) -> NDArray[np.uint8]:
    """SRGB values of linear ones, the bright ones compressed so that they keep their colour, shape ``[..., 3]``."""
    light = np.asarray(linear)
    room = 1 - SHOULDER
    light = np.where(light > SHOULDER, SHOULDER + room * (1 - np.exp((SHOULDER - light) / room)), light)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)


def _vectors(values: NDArray[np.floating]) -> wp.array:
    return wp.array(np.ascontiguousarray(values, np.float32), dtype=wp.vec3, device=_DEVICE)
