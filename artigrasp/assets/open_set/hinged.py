"""From the solids of two parts to a hinged object: masses and inertias are those of the pieces."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh

from artigrasp.assets.mass import Body, join_bodies
from artigrasp.assets.object_model import Mesh, PartModel, join_meshes
from artigrasp.assets.open_set.solids import Solid

_DIGITS = 5
"""Coordinates are written to a hundredth of a millimetre, which keeps files small."""


@dataclass(frozen=True)
class Hinge:
    """Where and how far the articulated part turns.

    Attributes:
        origin: A point of the axis [m].
        axis: Unit direction; turning positively about it opens.
        upper: Largest angle [rad]; the least is 0.
        damping: [N·m·s/rad].
        friction: [N·m].
    """

    origin: tuple[float, float, float]
    axis: tuple[float, float, float]
    upper: float
    damping: float = 0.02
    friction: float = 0.0


class Blueprint(NamedTuple):
    """A hinged object before it has a name: solids and mass [kg] of base and articulated part, and the hinge."""

    base: Sequence[Solid]
    base_mass: float
    articulated: Sequence[Solid]
    articulated_mass: float
    hinge: Hinge


def make_part(solids: Sequence[Solid], mass: float) -> PartModel:
    """The part of a mass [kg] that is made of these solids."""
    shown = [_rounded(solid.shown) for solid in solids]
    whole = join_meshes(shown)
    pieces = [(_rounded(piece), solid.density) for solid in solids for piece in solid.pieces]
    return PartModel(
        *_body(pieces, mass),
        vertices=whole.vertices,
        faces=whole.faces,
        pieces=tuple(piece for piece, _ in pieces),
        colours=np.concatenate(
            [np.tile(solid.colour, (len(mesh.faces), 1)) for solid, mesh in zip(solids, shown, strict=True)]
        ),
    )


def _body(pieces: Sequence[tuple[Mesh, float]], mass: float) -> Body:
    """The body of pieces of relative densities."""
    solids = [trimesh.Trimesh(piece.vertices, piece.faces, process=False) for piece, _ in pieces]
    shares = np.array([solid.volume * density for solid, (_, density) in zip(solids, pieces, strict=True)])
    masses = mass * shares / shares.sum()
    return join_bodies(
        [
            Body(float(share), np.array(solid.center_mass), np.array(solid.moment_inertia) * share / solid.volume)
            for solid, share in zip(solids, masses, strict=True)
        ]
    )


def _rounded(mesh: Mesh) -> Mesh:
    return Mesh(np.round(mesh.vertices, _DIGITS), mesh.faces)
