"""Contact sheets of objects: closed, half open and open."""

import os
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.errors import UserError
from artigrasp.export.camera import look_at
from artigrasp.export.image_file import STILL_SUFFIXES, check_image, save_image
from artigrasp.export.lettering import FAINT_INK, Band, arrange
from artigrasp.export.raycaster import render_surface
from artigrasp.export.surface import join, part_surface, place, rest

DIRECTION = tuple(np.radians((-58.0, 30.0)))
"""From the object, whose front is at -y, to the camera: azimuth from x, elevation [rad]."""
LABEL_SHARE = 0.16
"""Height of a label over that of a picture."""
MAX_CELLS = 400


def render_objects(
    names: Sequence[str],
    path: str | os.PathLike[str],
    *,
    openings: Sequence[float] = (0.0, 0.5, 1.0),
    size: int = 240,
    columns: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a contact sheet of objects that stand on their base.

    Args:
        names: Objects among the assets.
        path: The image file, its kind given by the suffix.
        openings: Hinge angles to show, as a share of the whole range.
        size: Width and height of a picture [px].
        columns: Objects in a row; by default such that the sheet is about square.
        progress: Called after each object with the number of those that are done and that of all.

    Raises:
        UserError: an object is not among the assets, a number cannot be, or the file cannot be written.
    """
    check_image(path, STILL_SUFFIXES)
    for field, value, least, most in (
        ("size", size, 32, 2000),
        ("columns", 1 if columns is None else columns, 1, MAX_CELLS),
        ("number of pictures", len(names) * len(openings), 1, MAX_CELLS),
    ):
        if not least <= value <= most:
            raise UserError(f"{field}: expected {least} to {most}, found {value}")
    if not all(0 <= opening <= 1 for opening in openings):
        raise UserError(f"openings: expected numbers from 0 to 1, found {', '.join(f'{each:g}' for each in openings)}")
    columns = min(len(names), columns or max(1, round(np.sqrt(len(names) / len(openings) * 1.5))))
    cells = []
    for name in names:
        object = load_object(name)
        pictures = _pictures(object, openings, size)
        cells.append(np.concatenate([pictures, _label(object, pictures.shape[1], round(LABEL_SHARE * size))]))
        if progress is not None:
            progress(len(cells), len(names))
    save_image(arrange(cells, columns), path)


def _pictures(object: ObjectModel, openings: Sequence[float], size: int) -> NDArray[np.uint8]:
    """An object at several hinge angles side by side, at one scale: sRGB, shape ``[size, openings * size, 3]``."""
    parts = [part_surface(part) for part in object.parts]
    colours = np.concatenate([colours for _, colours in parts])
    scenes = []
    for opening in openings:
        angle = object.hinge_lower + opening * (object.hinge_upper - object.hinge_lower)
        pose = np.concatenate(object.articulated_pose_in_base(angle))
        scenes.append(rest(join([parts[0][0], place(parts[1][0], pose)])))
    view = look_at(np.concatenate([scene.vertices for scene in scenes]), DIRECTION, 1.0)
    return np.concatenate([render_surface(scene, colours, view, width=size, height=size) for scene in scenes], axis=1)


def _label(object: ObjectModel, width: int, height: int) -> NDArray[np.uint8]:
    band = Band(width, height)
    vertices = object.vertices_in_base(0.0)
    sides = " × ".join(f"{100 * side:.0f}" for side in np.ptp(vertices, axis=0))
    base, articulated = object.parts
    end = band.write(12, 24, f"{object.name}   ", 20, bold=True)
    words = f"{sides} cm, {base.mass:.2g} + {articulated.mass:.2g} kg, to {np.degrees(object.hinge_upper):.0f}°"
    band.write(end, 24, words, 16, FAINT_INK)
    return band.image()
