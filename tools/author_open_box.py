"""Author the lidded box: an open object with a lid that fingers can lift.

    python tools/author_open_box.py [FOLDER]

writes ``lidded-box.usda`` to ``assets_usd/objects``. The walls enclose 0.24 m (x) by 0.18 m (y), the box is 0.14 m high
and stands on z = 0 with its centre above the origin. The hinge runs along the upper back edge; in front, at -y, the lid
reaches beyond the wall as a lip, and a little beyond the sides. It is made of boards, which are its collision pieces
too; the lid's upper edges are bevelled.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from artigrasp.assets.object import Mesh, ObjectModel, PartModel, write_object

WIDTH, DEPTH, HEIGHT, WALL = 0.24, 0.18, 0.14, 0.006
FOOT, FOOT_INSET = 0.008, 0.010
LID, LIP, SIDE_LIP, BEVEL, GAP = 0.012, 0.020, 0.008, 0.004, 0.001
BASE_MASS, LID_MASS = 0.8, 0.18
HINGE_DAMPING = 0.02
BASE_COLOUR, LID_COLOUR = (0.12, 0.32, 0.38), (0.93, 0.62, 0.22)


def lidded_box(folder: Path) -> ObjectModel:
    """The lidded box, to live in this folder."""
    x, y = WIDTH / 2, DEPTH / 2
    floor, top = FOOT + WALL, HEIGHT - LID - GAP
    base = [
        _board((-x + FOOT_INSET, -y + FOOT_INSET, 0), (x - FOOT_INSET, y - FOOT_INSET, FOOT)),
        _board((-x, -y, FOOT), (x, y, floor)),
        _board((-x, -y, floor), (x, -y + WALL, top)),
        _board((-x, y - WALL, floor), (x, y, top)),
        _board((-x, -y + WALL, floor), (-x + WALL, y - WALL, top)),
        _board((x - WALL, -y + WALL, floor), (x, y - WALL, top)),
    ]
    lid = [_board((-x - SIDE_LIP, -y - LIP, HEIGHT - LID), (x + SIDE_LIP, y, HEIGHT), bevel=BEVEL)]
    return ObjectModel(
        name="lidded-box",
        path=folder / "lidded-box.usda",
        parts=(_part(base, BASE_MASS, BASE_COLOUR), _part(lid, LID_MASS, LID_COLOUR)),
        hinge_origin=np.array([0.0, y, HEIGHT - LID]),
        hinge_axis=np.array([-1.0, 0.0, 0.0]),
        hinge_lower=0.0,
        hinge_upper=np.pi,
        hinge_damping=HINGE_DAMPING,
        hinge_friction=0.0,
    )


def _board(low: ArrayLike, high: ArrayLike, bevel: float = 0.0) -> trimesh.Trimesh:
    """A board between two corners, its upper edges bevelled by this much."""
    board: trimesh.Trimesh = trimesh.creation.box(bounds=np.array([low, high]))
    if not bevel:
        return board
    (x0, y0, z0), (x1, y1, z1) = board.bounds
    rings = [
        [(x0 + s, y0 + s, z), (x1 - s, y0 + s, z), (x1 - s, y1 - s, z), (x0 + s, y1 - s, z)]
        for s, z in ((0.0, z0), (0.0, z1 - bevel), (bevel, z1))
    ]
    faces = [(0, 2, 1), (0, 3, 2), (8, 9, 10), (8, 10, 11)]
    for first in (0, 4):
        for corner in range(4):
            a, b = first + corner, first + (corner + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    return trimesh.Trimesh(np.concatenate(rings), faces, process=False)


def _part(boards: list[trimesh.Trimesh], mass: float, colour: tuple[float, float, float]) -> PartModel:
    together: Any = trimesh.util.concatenate(boards)
    together.density = mass / together.volume
    return PartModel(
        mass=mass,
        com=np.array(together.center_mass),
        inertia=np.array(together.moment_inertia),
        vertices=np.array(together.vertices),
        faces=np.array(together.faces),
        pieces=tuple(Mesh(np.array(board.vertices), np.array(board.faces)) for board in boards),
        colours=np.tile(np.array(colour), (len(together.faces), 1)),
    )


def main() -> None:
    """Write the box."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "assets_usd" / "objects")
    box = lidded_box(folder)
    write_object(box)
    print(box.path)


if __name__ == "__main__":
    main()
