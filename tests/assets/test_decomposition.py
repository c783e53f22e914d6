"""Convex pieces: that they fit, are cut once, and are cut in processes that may fail."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from artigrasp.assets import cutting, decomposition
from artigrasp.assets.cutting import cut_meshes
from artigrasp.assets.decomposition import convex_pieces, is_cut
from artigrasp.assets.fidelity import volume_ratio
from artigrasp.assets.object import Mesh
from artigrasp.errors import UserError
from tests.assets.shapes import corner


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


def test_few_pieces_have_more_vertices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cylinder, which is one piece, is rounder than the 40 vertices allow that each of many pieces gets."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    cylinder = trimesh.creation.cylinder(0.05, 0.2, sections=50)
    (piece,) = convex_pieces(Mesh(np.array(cylinder.vertices), np.array(cylinder.faces)))
    assert 40 < len(piece.vertices) <= decomposition.VERTICES_OF_FEW


def test_damaged_cache_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache file that cannot be read is no obstacle."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    mesh = corner()
    count = len(convex_pieces(mesh))
    (cached,) = (tmp_path / "pieces").iterdir()
    cached.write_bytes(b"damaged")
    assert len(convex_pieces(mesh)) == count


def test_meshes_are_cut_side_by_side(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several processes cut several meshes; what is cut is told by name, and is not cut again."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    meshes = {"corner": corner(), "box": Mesh(np.array(box.vertices), np.array(box.faces))}
    told: list[str] = []
    cut_meshes(meshes, 2, told.append)
    assert sorted(told) == ["box", "corner"] and all(is_cut(mesh) for mesh in meshes.values())
    assert len(convex_pieces(meshes["corner"])) == 2
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "pieces").iterdir()}
    cut_meshes(meshes, 2, told.append)
    assert sorted(told) == ["box", "box", "corner", "corner"]
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "pieces").iterdir()} == before


def test_process_that_fails_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cutting is tried with every setting, each in its process; then the mesh is named with the last words."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    started: list[int] = []
    start = cutting._start

    def start_in_vain(mesh: Mesh, attempt: int, folder: Path) -> subprocess.Popen[bytes]:
        started.append(attempt)
        return start(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), attempt, folder)

    monkeypatch.setattr(cutting, "_start", start_in_vain)
    with pytest.raises(UserError, match=r"^lid: cannot cut this mesh into convex pieces: [^\n]+$"):
        cut_meshes({"lid": corner()}, 1, lambda name: None)
    assert started == [0, 1]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not limit processor time")
def test_process_without_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that uses too much processor time is killed by the system."""
    code = "from artigrasp.assets import cutting, decomposition\n"
    code += "cutting.TIME_LIMIT = 2\n"
    code += "def forever(*_):\n    while True: pass\n"
    code += "cutting.convex_pieces = forever\n"
    np.savez(tmp_path / "mesh.npz", vertices=corner().vertices, faces=corner().faces)
    code += f"cutting.cut_file({str(tmp_path / 'mesh.npz')!r}, '0')\n"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment, timeout=120).returncode < 0
