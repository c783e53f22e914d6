"""Author the lidded box: an open object with a lid that fingers can lift.

    python tools/author_open_box.py [FOLDER]

writes ``lidded-box.usda`` to ``assets_usd/objects``. The box is 0.24 m wide (x), 0.18 m deep (y) and 0.14 m high (z)
and stands on z = 0 with its centre above the origin. The hinge runs along the upper back edge; in front, at -y, the lid
reaches beyond the wall as a lip. It is made of boards, which are its collision pieces too.
"""

import sys
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from artigrasp.assets.object import Mesh, ObjectModel, PartModel, write_object

WIDTH, DEPTH, HEIGHT, WALL = 0.24, 0.18, 0.14, 0.006
LID, LIP, GAP = 0.008, 0.025, 0.001
BASE_MASS, LID_MASS = 0.8, 0.12
HINGE_DAMPING = 0.02
BASE_COLOUR, LID_COLOUR = (0.12, 0.32, 0.38), (0.93, 0.62, 0.22)


def lidded_box(folder: Path) -> ObjectModel:
    """The lidded box, to live in this folder."""
    x, y = WIDTH / 2, DEPTH / 2
    top = HEIGHT - LID - GAP
    base = [
        _board((-x, -y, 0), (x, y, WALL)),
        _board((-x, -y, WALL), (x, -y + WALL, top)),
        _board((-x, y - WALL, WALL), (x, y, top)),
        _board((-x, -y + WALL, WALL), (-x + WALL, y - WALL, top)),
        _board((x - WALL, -y + WALL, WALL), (x, y - WALL, top)),
    ]
    lid = [_board((-x, -y, HEIGHT - LID), (x, y, HEIGHT)), _board((-x, -y - LIP, HEIGHT - LID), (x, -y, HEIGHT))]
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


def _board(low: ArrayLike, high: ArrayLike) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def _part(boards: list[trimesh.Trimesh], mass: float, colour: tuple[float, float, float]) -> PartModel:
    together = trimesh.util.concatenate(boards)
    together.density = mass / together.volume
    return PartModel(
        mass=mass,
        com=np.array(together.center_mass),
        inertia=np.array(together.moment_inertia),
        vertices=np.array(together.vertices),
        faces=np.array(together.faces),
        pieces=tuple(Mesh(np.array(board.vertices), np.array(board.faces)) for board in boards),
        colour=colour,
    )


def main() -> None:
    """Write the box."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "assets_usd" / "objects")
    box = lidded_box(folder)
    write_object(box)
    print(box.path)


if __name__ == "__main__":
    main()
