"""Convex pieces: how well they fit, and that they are cut once."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from artigrasp.assets import decomposition
from artigrasp.assets.decomposition import convex_pieces, volume_ratio
from artigrasp.assets.object import Mesh


def corner() -> Mesh:
    """An L of two boards as one watertight mesh, which no single convex piece fits."""
    outline = [(0, 0), (0.1, 0), (0.1, 0.02), (0.02, 0.02), (0.02, 0.1), (0, 0.1)]
    triangles = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    solid = trimesh.creation.extrude_triangulation(np.array(outline), np.array(triangles), 0.05)
    return Mesh(np.array(solid.vertices), np.array(solid.faces))


def test_pieces_fit_and_are_cut_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pieces of an L are its two boards; asking again reads them from the cache."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    mesh = corner()
    pieces = convex_pieces(mesh)
    assert len(pieces) == 2
    assert volume_ratio(mesh, pieces) == pytest.approx(1.0, abs=0.03)
    monkeypatch.setattr(decomposition, "_decompose", lambda *_: pytest.fail("decomposed twice"))
    again = convex_pieces(mesh)
    for piece, other in zip(pieces, again, strict=True):
        np.testing.assert_array_equal(piece.vertices, other.vertices)
        np.testing.assert_array_equal(piece.faces, other.faces)


def test_damaged_cache_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache file that cannot be read is no obstacle."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    mesh = corner()
    count = len(convex_pieces(mesh))
    (cached,) = (tmp_path / "pieces").iterdir()
    cached.write_bytes(b"damaged")
    assert len(convex_pieces(mesh)) == count


def test_volume_ratio_sees_filled_gaps() -> None:
    """The hull of an L has more than twice its volume, and overlapping pieces are not counted twice."""
    mesh = corner()
    hull = trimesh.convex.convex_hull(mesh.vertices)
    piece = Mesh(np.array(hull.vertices), np.array(hull.faces))
    expected = hull.volume / abs(trimesh.Trimesh(mesh.vertices, mesh.faces).volume)
    assert volume_ratio(mesh, (piece,)) == pytest.approx(expected, rel=0.01)
    assert volume_ratio(mesh, (piece, piece)) == pytest.approx(expected, rel=0.01)
