"""From the solids of two parts to a hinged object: masses and inertias are those of the pieces."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh

from artigrasp.assets.object_model import Array, Mesh, PartModel
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
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in shown)])[:-1]
    pieces = [(_rounded(piece), solid.density) for solid in solids for piece in solid.pieces]
    com, inertia = _inertia(pieces, mass)
    return PartModel(
        mass=mass,
        com=com,
        inertia=inertia,
        vertices=np.concatenate([mesh.vertices for mesh in shown]),
        faces=np.concatenate([mesh.faces + start for mesh, start in zip(shown, starts, strict=True)]),
        pieces=tuple(piece for piece, _ in pieces),
        colours=np.concatenate(
            [np.tile(solid.colour, (len(mesh.faces), 1)) for solid, mesh in zip(solids, shown, strict=True)]
        ),
    )


def _inertia(pieces: Sequence[tuple[Mesh, float]], mass: float) -> tuple[Array, Array]:
    """Centre of mass [m] and inertia about it [kg·m²] of pieces of relative densities."""
    bodies = [trimesh.Trimesh(piece.vertices, piece.faces, process=False) for piece, _ in pieces]
    shares = np.array([body.volume * density for body, (_, density) in zip(bodies, pieces, strict=True)])
    masses = mass * shares / shares.sum()
    centres = np.array([body.center_mass for body in bodies])
    com: Array = masses @ centres / mass
    inertia = np.zeros((3, 3))
    for body, share, centre in zip(bodies, masses, centres, strict=True):
        offset = centre - com
        inertia += body.moment_inertia * share / body.volume
        inertia += share * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return com, inertia


def _rounded(mesh: Mesh) -> Mesh:
    return Mesh(np.round(mesh.vertices, _DIGITS), mesh.faces)
