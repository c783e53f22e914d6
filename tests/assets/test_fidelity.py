"""How closely pieces follow a mesh, holes, and masses: against what can be worked out."""

import numpy as np
import pytest
import trimesh

from artigrasp.assets.decomposition import convex_pieces
from artigrasp.assets.fidelity import measure_fidelity, union_volume, volume_ratio
from artigrasp.assets.holes import close_holes, open_edges
from artigrasp.assets.mass import body_of_mesh
from artigrasp.assets.object import Mesh
from tests.assets.shapes import box, corner, hull


def grown(mesh: Mesh, margin: float) -> Mesh:
    """A box that is larger on every side."""
    return Mesh(mesh.vertices + margin * np.sign(mesh.vertices), mesh.faces)


def solid(mesh: Mesh) -> trimesh.Trimesh:
    """The mesh for measuring."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def test_volume_ratio_sees_filled_gaps() -> None:
    """The hull of an L has more than twice its volume, and overlapping pieces are not counted twice."""
    mesh, piece = corner(), hull(corner())
    expected = solid(piece).volume / solid(mesh).volume
    assert volume_ratio(mesh, (piece,)) == pytest.approx(expected, rel=0.01)
    assert volume_ratio(mesh, (piece, piece)) == pytest.approx(expected, rel=0.01)
    assert union_volume((piece,)) == pytest.approx(solid(piece).volume, rel=0.01)


@pytest.mark.parametrize("extents", [(1e4, 1e-6, 1e-6), (1.0, 1.0, 1e-9)])
def test_volume_of_a_needle_takes_no_more_than_others(extents: tuple[float, float, float]) -> None:
    """Cells as fine as they are thick would be billions."""
    assert union_volume((Mesh(box().vertices * extents, box().faces),)) >= 0


@pytest.mark.parametrize("margin", [0.0, 0.002, -0.003])
def test_distances_are_the_margin(margin: float) -> None:
    """A piece that is a little larger or smaller than its box is that far from it, both ways, on all of its faces."""
    fit = measure_fidelity(box(), (grown(box(), margin),))
    assert fit.outward_median_mm == fit.inward_median_mm == pytest.approx(1000 * abs(margin), abs=0.01)
    # Near edges and corners it is further.
    assert fit.inward_p95_mm == pytest.approx(1000 * abs(margin), rel=0.2, abs=0.01)
    assert fit.outward_p95_mm == pytest.approx(1000 * abs(margin), rel=0.2, abs=0.01)
    assert fit.pieces == 1 and fit.open_edges == 0


def test_where_pieces_meet_is_no_surface() -> None:
    """Two halves of a box fit it perfectly: the faces inside are not the surface; a wide slit between them is."""
    low, high = trimesh.creation.box((0.06, 0.10, 0.08)), trimesh.creation.box((0.06, 0.10, 0.08))
    for offset, worst in ((0.0, 0.02), (2e-4, 0.3), (5e-3, 50.0)):
        halves = []
        for half, sign in ((low, -1), (high, 1)):
            place = np.array([sign * (0.03 + offset / 2), 0.0, 0.0])
            halves.append(Mesh(np.array(half.vertices) + place, np.array(half.faces)))
        fit = measure_fidelity(box(), tuple(halves))
        assert fit.outward_p95_mm < worst and (worst < 1 or fit.outward_p95_mm > 10)


def test_filled_gap_is_far_from_the_mesh() -> None:
    """The slope that a hull puts over the corner of an L is centimetres from it; its true pieces are not."""
    filled, true = (measure_fidelity(corner(), pieces) for pieces in ((hull(corner()),), convex_pieces(corner())))
    assert filled.outward_p95_mm > 15 and filled.inward_p95_mm > 15
    assert true.outward_p95_mm < 0.1 and true.inward_p95_mm < 0.1
    assert true.volume_ratio == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("removed", [[0], [0, 1], [0, 5, 9], [3, 4, 5, 6]])
def test_holes_are_closed(removed: list[int]) -> None:
    """Missing faces are made up for: the surface encloses a volume that does not depend on where it is."""
    faces = np.delete(corner().faces, removed, axis=0)
    opened = Mesh(corner().vertices, faces)
    assert open_edges(opened) > 0
    closed = close_holes(opened)
    np.testing.assert_array_equal(closed.faces[: len(faces)], faces)
    # Fans over holes that share a corner share an edge.
    assert solid(closed).is_watertight == (removed != [0, 5, 9]) and solid(closed).is_winding_consistent
    moved = Mesh(closed.vertices + 1.0, closed.faces)
    assert solid(moved).volume == pytest.approx(solid(closed).volume, rel=1e-6)


def test_closed_meshes_stay_as_they_are() -> None:
    """Neither a watertight mesh nor one that touches itself along an edge has a hole."""
    assert close_holes(corner()) is not None and open_edges(corner()) == 0
    mesh = corner()
    assert close_holes(mesh) is mesh
    a, b = box((0.1, 0.1, 0.1)), box((0.1, 0.1, 0.1))
    both = trimesh.util.concatenate([solid(a), trimesh.Trimesh(b.vertices + np.array([0.1, 0.1, 0.0]), b.faces)])
    both.merge_vertices()
    touching = Mesh(np.array(both.vertices), np.array(both.faces))
    assert open_edges(touching) == 1
    assert close_holes(touching) is touching


def test_single_triangle_is_fanned_over() -> None:
    """A box without one triangle gets three for it, in its plane."""
    opened = Mesh(box().vertices, box().faces[1:])
    closed = close_holes(opened)
    assert len(closed.faces) == 11 + 3 and solid(closed).volume == pytest.approx(solid(box()).volume)


def test_mass_of_a_mesh() -> None:
    """A box weighs and turns as the formula says, wound either way; a tangled one as its pieces do."""
    x, y, z = 0.12, 0.10, 0.08
    mass = 500.0 * x * y * z
    inertia = mass / 12 * np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2])
    for mesh in (box(), Mesh(box().vertices, box().faces[:, ::-1]), Mesh(box().vertices, box().faces[1:])):
        body = body_of_mesh(mesh, (box(),), 500.0)
        assert body.mass == pytest.approx(mass, rel=1e-6)
        np.testing.assert_allclose(body.com, 0.0, atol=1e-9)
        np.testing.assert_allclose(body.inertia, inertia, rtol=1e-6, atol=1e-12)
    flipped = box().faces.copy()
    flipped[0] = flipped[0, ::-1]
    body = body_of_mesh(Mesh(box().vertices, flipped), (box(), box()), 500.0)
    assert body.mass == pytest.approx(mass, rel=0.01)
    np.testing.assert_allclose(body.inertia, inertia, rtol=0.02, atol=1e-9)
