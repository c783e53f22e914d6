"""Contact sheets of references: each as a small picture of the object with the hands in their target pose."""

import os
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.export.camera import look_at
from artigrasp.export.hand_surface import hand_surface
from artigrasp.export.image_file import STILL_SUFFIXES, check_image, save_image
from artigrasp.export.lettering import FAINT_INK, INK, Band, Rgb, arrange
from artigrasp.export.raycaster import render_surface, tone_mapped
from artigrasp.export.surface import Surface, join, part_surface, place, rest
from artigrasp.export.viewpoint import telling_directions
from artigrasp.kernels.layout import HANDS
from artigrasp.motion.kinematics import posed_references
from artigrasp.references.reference import ReferenceSet

CONTACT = (0.72, 0.03, 0.06)
"""Linear RGB of links that should touch the object."""
CONTACT_WEIGHT, OBJECT_WEIGHT = 3.0, 0.05
"""How much it matters to see such links, and the object, each over that of other links."""
CLOSE_UP = 1.2
"""How much more than the hands the second picture holds."""
LABEL_SHARE = 0.2
"""Height of a label over that of a picture."""
WARNING: Rgb = (200, 60, 40)
"""Colour of what is odd."""
GAP = 6
"""Between cells [px]."""
MAX_CELLS = 1000


class ReferencePictures:
    """Renders references of one object.

    Args:
        references: The references.
        size: Width and height of a picture [px].
        views: Pictures of each reference: 1, of all there is, or 2, the second from another side and nearer the hands.
        links: Whether hands are shown as the rigid links that collide, without skin.

    Raises:
        UserError: the references' hand or object is not among the assets.
    """

    def __init__(self, references: ReferenceSet, *, size: int, views: int, links: bool = False) -> None:
        self._references, self._size, self._views = references, size, views
        hands, object = [load_hand(references.hand, side) for side in HANDS], load_object(references.object)
        self._hands = [hand_surface(hand, rigid=links) for hand in hands]
        self._parts = [part_surface(part) for part in object.parts]
        self._link_poses, self._part_poses = posed_references(references, hands, object)

    def scene(self, row: int) -> tuple[Surface, Array, Array]:
        """What a reference shows: a surface that rests on z = 0, the colour of each face, and how much it matters."""
        surfaces, colours, weights = [], [], []
        for hand in np.flatnonzero(self._references.active[row]):
            touches = self._references.contacts[row, hand].astype(float)
            surfaces.append(self._hands[hand].posed(self._link_poses[row, hand]))
            touching = self._hands[hand].of_faces(touches)
            skin = self._hands[hand].colours
            colours.append((1 - touching[:, None]) * skin + touching[:, None] * np.array(CONTACT))
            weights.append(1.0 + touching * (CONTACT_WEIGHT - 1.0))
        for part, (surface, colours_of_faces) in enumerate(self._parts):
            surfaces.append(place(surface, self._part_poses[row, part]))
            colours.append(colours_of_faces)
            weights.append(np.full(len(surfaces[-1].faces), OBJECT_WEIGHT))
        # Hands may be below the object: the floor is below them.
        return rest(join(surfaces)), np.concatenate(colours), np.concatenate(weights)

    def render(self, row: int) -> NDArray[np.uint8]:
        """Render a reference: sRGB, shape ``[size, views * size, 3]``."""
        surface, colours, weights = self.scene(row)
        hands = surface.vertices[np.unique(surface.faces[weights > OBJECT_WEIGHT])]
        middle = hands.mean(axis=0)
        pictures = [
            render_surface(surface, colours, look_at(points, direction, 1.0), width=self._size, height=self._size)
            for direction, points in zip(
                telling_directions(surface, weights, self._views),
                (surface.vertices, middle + CLOSE_UP * (hands - middle)),
                strict=False,
            )
        ]
        return np.concatenate(pictures, axis=1)


def render_references(
    sets: Sequence[ReferenceSet],
    path: str | os.PathLike[str],
    *,
    numbers: Sequence[Sequence[int]] | None = None,
    title: str = "",
    size: int = 200,
    views: int = 2,
    links: bool = False,
    columns: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a contact sheet of references: the hands that take part, on the object as the reference begins.

    Links that should touch the object are red. The floor is below the hands, where they are below the object.

    Args:
        sets: References of one object each.
        path: The image file, its kind given by the suffix.
        numbers: What to call each reference of each set; from 0 by default.
        title: What is said above.
        size: Width and height of a picture [px].
        views: Pictures of each reference: 1, of all there is from where most of the hands is seen, or 2, the second
            from another side and nearer the hands.
        links: Whether hands are shown as the rigid links that collide, without skin.
        columns: References in a row; by default such that the sheet is about square.
        progress: Called after each reference with the number of those that are done and that of all.

    Raises:
        UserError: a hand or an object is not among the assets, a number cannot be, or the file cannot be written.
    """
    check_image(path, STILL_SUFFIXES)
    count = sum(map(len, sets))
    for name, value, least, most in (
        ("size", size, 32, 2000),
        ("views", views, 1, 2),
        ("columns", 1 if columns is None else columns, 1, MAX_CELLS),
        ("number of references", count, 1, MAX_CELLS),
    ):
        if not least <= value <= most:
            raise UserError(f"{name}: expected {least} to {most}, found {value}")
    width, height = views * size, round(LABEL_SHARE * size)
    columns = min(count, columns or max(1, round(np.sqrt(count * (size + height) / width * 1.4))))
    cells = []
    for index, references in enumerate(sets):
        pictures = ReferencePictures(references, size=size, views=views, links=links)
        for row in range(len(references)):
            number = row if numbers is None else numbers[index][row]
            words = label(references, row, number, width, height, with_object=len(sets) > 1)
            cells.append(_framed(np.concatenate([pictures.render(row), words])))
            if progress is not None:
                progress(len(cells), count)
    sheet = arrange(cells, columns)
    save_image(np.concatenate([_header(title, sheet.shape[1], height), sheet]), path)


def label(
    references: ReferenceSet, row: int, number: int, width: int, height: int, *, with_object: bool = False
) -> NDArray[np.uint8]:
    """The words below a reference: number, kind, hands, contacts, where it came from and how far open it begins.

    Returns:
        sRGB, shape ``[height, width, 3]``.
    """
    band = Band(width, height)
    sides = "both" if references.active[row].all() else HANDS[int(references.active[row].argmax())]
    end = band.write(12, 24, f"{number}  ", 22, bold=True)
    name = f"{references.object} " if with_object else ""
    contacts = int(references.contacts[row].sum())
    end = band.write(end, 24, f"{name}{references.kind[row]}, {sides}", 20)
    band.write(end, 24, f"  {contacts} contact{'s' * (contacts != 1)}", 20, FAINT_INK if contacts else WARNING)
    end = band.write(12, 50, _source(references, row), 17, FAINT_INK)
    if degrees := round(np.degrees(references.object_angle[row])):
        band.write(end, 50, f"  open {degrees}°", 17, INK)
    return band.image()


def _source(references: ReferenceSet, row: int) -> str:
    """Where a reference came from, in few words."""
    if not references.sequence[row]:
        return f"{references.split[row]}  {references.source[row]}"[:60]
    return f"{references.split[row]}  {references.subject[row]} {references.sequence[row]} {references.frame[row]}"


def _header(title: str, width: int, height: int) -> NDArray[np.uint8]:
    band = Band(width, height)
    end = band.write(12, 36, f"{title}   ", 26, INK, bold=True)
    red: Rgb = tuple(tone_mapped(CONTACT).tolist())
    band.bar(end, 18, end + 20, 36, red)
    band.write(end + 26, 36, "should touch the object", 20, FAINT_INK)
    return band.image()


def _framed(cell: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A cell with a white edge, so that cells do not run together."""
    return np.pad(cell, ((0, GAP), (0, GAP), (0, 0)), constant_values=255)
