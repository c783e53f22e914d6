"""Is this asset fit for simulation, and if not, how is it mended?"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from artigrasp.arrays import Array
from artigrasp.assets import hand_usd, object_usd
from artigrasp.assets.decomposition import SETTINGS, VERTICES_OF_FEW
from artigrasp.assets.fidelity import volume_ratio
from artigrasp.assets.hand import HandModel, read_hand
from artigrasp.assets.holes import open_edges
from artigrasp.assets.object import Mesh, ObjectModel, PartModel, read_object
from artigrasp.assets.usd_stage import open_stage
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOFS, FINGERS, LINKS, PARTS, WRIST_DOF_COUNT

MAX_PIECES = int(SETTINGS["max_convex_hull"])
MAX_PIECE_VERTICES = VERTICES_OF_FEW
"""Solvers keep no more vertices of a convex piece."""
MAX_EFFORT = 5.0
"""Joint torques above this squeeze objects out of the hand and let solvers diverge [N·m]."""


_IMPORT = "artigrasp import-object makes an asset of a hinged object in URDF or USD"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong.

    Attributes:
        severity: ``"error"``: it cannot be simulated as it is; ``"warning"``: it can, but probably not as meant.
        field: What it is about.
        problem: What was expected and what was found.
        remedy: How to mend it.
    """

    severity: Literal["error", "warning"]
    field: str
    problem: str
    remedy: str


@dataclass(frozen=True)
class AssetReport:
    """What a check found.

    Attributes:
        path: The file.
        format: Its format.
        facts: What was measured, by name with unit.
        findings: What is wrong, errors first.
    """

    path: Path
    format: str
    facts: dict[str, float]
    findings: tuple[Finding, ...]

    @property
    def usable(self) -> bool:
        """Whether it can be simulated."""
        return all(finding.severity != "error" for finding in self.findings)


class _Findings(list[Finding]):
    """Collects findings."""

    def expect(
        self, true: bool | np.bool_, severity: Literal["error", "warning"], field: str, problem: str, remedy: str
    ) -> None:
        """Add a finding unless what is expected is true."""
        if not true:
            self.append(Finding(severity, field, problem, remedy))


def check_asset(path: Path) -> AssetReport:
    """Check a hand or an object.

    Raises:
        UserError: the file is missing, is neither, or lacks a part of one.
    """
    if path.suffix != ".usda":
        raise UserError(f"{path}: expected a file that ends in .usda; {_IMPORT}")
    format = str(open_stage(path).GetRootLayer().customLayerData.get("format"))
    findings = _Findings()
    if format == hand_usd.FORMAT:
        facts = _check_hand(read_hand(path), findings)
    elif format == object_usd.FORMAT:
        facts = _check_object(read_object(path), findings)
    else:
        expected = f"{hand_usd.FORMAT!r} or {object_usd.FORMAT!r}"
        found = "none" if format == "None" else repr(format)
        raise UserError(f"{path}: format: expected {expected}, found {found}; {_IMPORT}")
    return AssetReport(path, format, facts, tuple(sorted(findings, key=lambda finding: finding.severity)))


def _check_hand(hand: HandModel, findings: _Findings) -> dict[str, float]:
    reach = np.linalg.norm(hand.link_offset[1:].reshape(len(FINGERS), 3, 3), axis=2).sum(axis=1).max()
    mass = hand.link_mass.sum()
    findings.expect(
        0.1 < reach < 0.3,
        "error",
        "scale",
        f"expected 0.1 to 0.3 m from the wrist to the last joint of the longest finger, found {reach:.3g}",
        "author the hand in metres",
    )
    findings.expect(
        0.1 < mass < 2.0, "warning", "mass", f"expected 0.1 to 2 kg, found {mass:.3g}", "mend the links' masses"
    )
    for name, link_mass, inertia in zip(LINKS, hand.link_mass, hand.link_inertia, strict=True):
        _check_inertia(name, link_mass, inertia, 0.2, findings)
    for index in np.flatnonzero(hand.lower >= hand.upper):
        findings.expect(
            False,
            "error",
            f"limits of {DOFS[index]}",
            f"expected lower < upper, found {hand.lower[index]:.3g} and {hand.upper[index]:.3g}",
            "swap them or open the range",
        )
    for index in np.flatnonzero(hand.damping <= 0):
        findings.expect(
            False,
            "error",
            f"damping of {DOFS[index]}",
            f"expected more than 0, found {hand.damping[index]:.3g}",
            "damp every joint: undamped hands diverge at their first contact",
        )
    strongest = hand.effort[WRIST_DOF_COUNT:].max()
    findings.expect(
        strongest <= MAX_EFFORT,
        "warning",
        "effort",
        f"expected finger torques up to {MAX_EFFORT:g} N·m, found {strongest:.3g}",
        "lower the drives' maxForce: strong fingers squeeze objects out of the hand",
    )
    for name, colliders in zip(LINKS, hand.colliders, strict=True):
        findings.expect(
            bool(colliders), "error", name, "expected a collision shape, found none", "give the link a capsule"
        )
    return {"mass_kg": float(mass), "reach_m": float(reach), "colliders": float(sum(map(len, hand.colliders)))}


def _check_object(model: ObjectModel, findings: _Findings) -> dict[str, float]:
    vertices = model.vertices_in_base(0.0)
    size = float(np.ptp(vertices, axis=0).max())
    findings.expect(
        0.02 < size < 2.0,
        "error",
        "scale",
        f"expected a size of 0.02 to 2 m, found {size:.3g}",
        "author it in metres; ARCTIC's own meshes are in millimetres",
    )
    facts = {"size_m": size, "mass_kg": sum(part.mass for part in model.parts)}
    for name, part in zip(PARTS, model.parts, strict=True):
        facts |= _check_part(name, part, findings)
    findings.expect(
        model.hinge_lower < model.hinge_upper and model.hinge_upper - model.hinge_lower < 2 * np.pi,
        "error",
        "hinge limits",
        f"expected lower < upper less than a turn apart, found {model.hinge_lower:.3g} and {model.hinge_upper:.3g} rad",
        "author physics:lowerLimit and upperLimit in degrees",
    )
    findings.expect(
        model.hinge_lower - 1e-6 <= 0 <= model.hinge_upper,
        "warning",
        "hinge limits",
        f"expected 0 between them, found {model.hinge_lower:.3g} and {model.hinge_upper:.3g} rad",
        "let angle 0 be the closed object",
    )
    to_vertices = vertices - model.hinge_origin
    distance = float(np.linalg.norm(np.cross(to_vertices, model.hinge_axis), axis=1).min())
    findings.expect(
        distance < 0.5 * size,
        "warning",
        "hinge",
        f"expected its axis at the object, found it {distance:.3g} m away",
        "move physics:localPos0 and localPos1 to the hinge",
    )
    return facts | {"hinge_range_rad": model.hinge_upper - model.hinge_lower}


def _check_part(name: str, part: PartModel, findings: _Findings) -> dict[str, float]:
    surface = Mesh(part.vertices, part.faces)
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    _check_inertia(name, part.mass, part.inertia, float(np.linalg.norm(high - low)), findings)
    findings.expect(
        ((low <= part.com) & (part.com <= high)).all(),
        "warning",
        f"{name}: centre of mass",
        f"expected it within the part, found {np.round(part.com, 3).tolist()} m",
        "author physics:centerOfMass in the part's frame, in metres",
    )
    edges = open_edges(surface)
    findings.expect(
        edges == 0,
        "warning",
        f"{name}: visual",
        f"expected a watertight mesh, found {edges} edges that are not shared by two faces",
        "close the mesh's holes",
    )
    facts = {"pieces": float(len(part.pieces)), "open_edges": float(edges), "mass_kg": part.mass}
    findings.expect(
        0 < len(part.pieces) <= MAX_PIECES,
        "error" if not part.pieces else "warning",
        f"{name}: pieces",
        f"expected 1 to {MAX_PIECES} collision pieces, found {len(part.pieces)}",
        "decompose the mesh into convex pieces",
    )
    for index, piece in enumerate(part.pieces):
        _check_piece(f"{name}: piece_{index:02d}", piece, findings)
    if part.pieces and edges == 0:
        ratio = volume_ratio(surface, part.pieces)
        findings.expect(
            0.85 < ratio < 1.25,
            "warning",
            f"{name}: pieces",
            f"expected about the volume of the visual mesh, found {ratio:.2f} of it",
            "decompose the mesh with a smaller threshold: coarse pieces fill the gaps that fingers need",
        )
        facts["pieces_volume_ratio"] = ratio
    return {f"{name}_{fact}": value for fact, value in facts.items()}


def _check_piece(field: str, piece: Mesh, findings: _Findings) -> None:
    findings.expect(
        len(piece.vertices) <= MAX_PIECE_VERTICES,
        "warning",
        field,
        f"expected at most {MAX_PIECE_VERTICES} vertices, found {len(piece.vertices)}",
        "decompose the mesh again with fewer vertices per piece",
    )
    try:
        hull = trimesh.convex.convex_hull(piece.vertices)
        volume = trimesh.Trimesh(piece.vertices, piece.faces, process=False).volume
        convex = hull.volume > 0 and volume > 0.99 * hull.volume
    except Exception:  # Too few or coplanar points have no hull.
        convex = False
    findings.expect(
        convex,
        "error",
        field,
        "expected a convex solid with its faces outwards, found none",
        "decompose the mesh into convex pieces",
    )


def _check_inertia(name: str, mass: float, inertia: Array, size: float, findings: _Findings) -> None:
    moments = np.linalg.eigvalsh(inertia)
    findings.expect(
        mass > 0, "error", f"{name}: mass", f"expected more than 0, found {mass:.3g} kg", "author physics:mass"
    )
    findings.expect(
        moments[0] > 0 and moments[0] + moments[1] >= moments[2] * (1 - 1e-3),
        "error",
        f"{name}: inertia",
        f"expected positive moments of which two add to more than the third, found {moments}",
        "author physics:diagonalInertia about the centre of mass in kg·m²",
    )
    findings.expect(
        moments[2] <= mass * size**2,
        "warning",
        f"{name}: inertia",
        f"expected at most that of the mass at the part's ends, {mass * size**2:.3g} kg·m², found {moments[2]:.3g}",
        "author physics:diagonalInertia about the centre of mass in kg·m²",
    )
