"""Checking assets: good ones pass, and every kind of damage is found and answered with a remedy."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from artigrasp.assets.check import AssetReport, check_asset
from artigrasp.assets.hand import HandModel, load_hand, write_hand
from artigrasp.assets.library import packaged_root
from artigrasp.assets.object import Mesh, ObjectModel, PartModel, load_object, write_object
from artigrasp.errors import UserError

SHIPPED = sorted(
    path.relative_to(packaged_root())
    for kind in ("hands", "objects")
    for path in packaged_root().glob(f"{kind}/*.usda")
)


@pytest.mark.parametrize("path", SHIPPED, ids=str)
def test_shipped_assets_are_flawless(path: Path) -> None:
    """Everything that is shipped passes without a warning."""
    report = check_asset(packaged_root() / path)
    assert report.findings == () and report.usable


def check_base(change: Callable[[PartModel], PartModel], path: Path) -> AssetReport:
    """Check the box after its base was changed."""
    box = load_object("lidded-box")
    return check_object(replace(box, parts=(change(box.parts[0]), box.parts[1])), path)


def check_object(model: ObjectModel, path: Path) -> AssetReport:
    """Check an object."""
    write_object(replace(model, path=path))
    return check_asset(path)


def assert_finding(report: AssetReport, severity: str, field: str) -> None:
    """There is one finding of this kind, with a remedy."""
    found = [finding for finding in report.findings if finding.field == field and finding.severity == severity]
    assert len(found) == 1 and found[0].remedy
    assert report.usable == all(finding.severity != "error" for finding in report.findings)


def millimetres(part: PartModel) -> PartModel:
    """The part as if metres were millimetres."""
    pieces = tuple(Mesh(piece.vertices * 1000, piece.faces) for piece in part.pieces)
    return replace(part, vertices=part.vertices * 1000, pieces=pieces)


def with_pieces(*pieces: Mesh) -> Callable[[PartModel], PartModel]:
    """Replaces a part's pieces."""
    return lambda part: replace(part, pieces=pieces)


def sphere() -> Mesh:
    """A piece with many vertices."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    return Mesh(np.array(mesh.vertices), np.array(mesh.faces))


def bent(part: PartModel) -> PartModel:
    """The part with two boards as one piece, which is not convex."""
    first, second = part.pieces[:2]
    vertices = np.concatenate([first.vertices, second.vertices])
    faces = np.concatenate([first.faces, second.faces + len(first.vertices)])
    return replace(part, pieces=(Mesh(vertices, faces),))


@pytest.mark.parametrize(
    ("change", "severity", "field"),
    [
        (millimetres, "error", "scale"),
        (lambda part: replace(part, inertia=np.diag([1.0, 1.0, 9.0])), "error", "base: inertia"),
        (lambda part: replace(part, inertia=part.inertia * 1e3), "warning", "base: inertia"),
        (lambda part: replace(part, com=np.array([0.0, 0.0, 80.0])), "warning", "base: centre of mass"),
        (lambda part: replace(part, faces=part.faces[:-1]), "warning", "base: visual"),
        (with_pieces(), "error", "base: pieces"),
        (with_pieces(sphere()), "warning", "base: piece_00"),
        (bent, "error", "base: piece_00"),
        (lambda part: replace(part, pieces=part.pieces[:1]), "warning", "base: pieces"),
        (lambda part: replace(part, pieces=part.pieces * 7), "warning", "base: pieces"),
    ],
    ids=["scale", "inertia", "inertia-unit", "com", "open", "none", "vertices", "concave", "volume", "count"],
)
def test_damaged_part_is_found(
    change: Callable[[PartModel], PartModel], severity: str, field: str, tmp_path: Path
) -> None:
    """Each kind of damage of a part gives one finding under its name."""
    assert_finding(check_base(change, tmp_path / "damaged.usda"), severity, field)


def test_damaged_hinge_is_found(tmp_path: Path) -> None:
    """Limits in the wrong order and a hinge far away are found."""
    box = load_object("lidded-box")
    report = check_object(replace(box, hinge_upper=-0.5), tmp_path / "limits.usda")
    assert_finding(report, "error", "hinge limits")
    report = check_object(replace(box, hinge_origin=np.array([0.0, 90.0, 0.0])), tmp_path / "origin.usda")
    assert_finding(report, "warning", "hinge")


@pytest.mark.parametrize(
    ("change", "severity", "field"),
    [
        (lambda hand: {"link_offset": hand.link_offset * 1000}, "error", "scale"),
        (lambda hand: {"link_mass": hand.link_mass * 1000}, "warning", "mass"),
        (lambda hand: {"lower": hand.lower + 10.0 * (np.arange(51) == 8)}, "error", "limits of index1_rz"),
        (lambda hand: {"damping": hand.damping * (np.arange(51) != 3)}, "error", "damping of wrist_rx"),
        (lambda hand: {"effort": hand.effort * 300}, "warning", "effort"),
        (lambda hand: {"colliders": ((), *hand.colliders[1:])}, "error", "wrist"),
    ],
    ids=["scale", "mass", "limits", "damping", "effort", "colliders"],
)
def test_damaged_hand_is_found(
    change: Callable[[HandModel], dict[str, object]], severity: str, field: str, tmp_path: Path
) -> None:
    """Each kind of damage of a hand gives a finding under its name."""
    hand = load_hand("open", "right")
    damaged = replace(hand, path=tmp_path / "damaged.usda", **change(hand))
    write_hand(damaged)
    assert_finding(check_asset(damaged.path), severity, field)


def test_file_of_no_known_kind_is_refused(tmp_path: Path) -> None:
    """USD that is neither hand nor object is refused by name."""
    path = tmp_path / "scene.usda"
    path.write_text('#usda 1.0\ndef Xform "World" {}\n')
    with pytest.raises(UserError, match=r"scene.usda: format: expected 'artigrasp.hand' or .*, found none"):
        check_asset(path)


def test_usd_complaints_stay_off_the_terminal(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What USD would print about a broken file becomes one line of an error instead."""
    path = tmp_path / "broken.usda"
    path.write_text("#usda 1.0\ndef Xform {{{\n")
    with pytest.raises(UserError, match=r"broken.usda: cannot read this as USD: .*:2:1: .* at 'def Xform {{{'"):
        check_asset(path)
    assert capfd.readouterr().err == ""
