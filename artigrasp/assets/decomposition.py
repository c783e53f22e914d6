"""Convex pieces of a mesh, by CoACD, kept by the mesh's hash because a decomposition takes seconds to minutes.

Coarse pieces fill handles and gaps between parts, and hands then cannot open the object; these follow the mesh closely.
"""

import hashlib
import json
import logging
import os
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

from artigrasp.arrays import load_arrays, save_arrays
from artigrasp.assets.holes import close_holes
from artigrasp.assets.object_model import Mesh
from artigrasp.errors import UserError

logger = logging.getLogger(__name__)

FORMAT, VERSION = "artigrasp.pieces", 1
FEW_PIECES, VERTICES_OF_FEW = 12, 64
"""Where so few pieces do, each may have so many vertices: that costs no more, and large round pieces need them."""
SETTINGS: dict[str, Any] = {
    "threshold": 0.02,
    "max_convex_hull": 32,
    "decimate": True,
    "max_ch_vertex": 40,
    "preprocess_mode": "off",
    "seed": 0,
}
"""How a mesh is cut: as it is, its holes closed."""
REMESHED: dict[str, Any] = SETTINGS | {"preprocess_mode": "on", "preprocess_resolution": 30}
"""How one is cut that CoACD cannot cut as it is: remeshed first, which takes minutes and thickens walls by half."""


def cache_folder() -> Path:
    """Where results that can be computed again are kept: ``$ARTIGRASP_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("ARTIGRASP_CACHE")
    return Path(chosen).expanduser() if chosen else platformdirs.user_cache_path("artigrasp")


def is_cut(mesh: Mesh) -> bool:
    """Whether a mesh was cut before, so that :func:`convex_pieces` has its pieces at once."""
    try:
        _load(_cache_path(mesh))
    except UserError:
        return False
    return True


def convex_pieces(mesh: Mesh, settings: dict[str, Any] = SETTINGS) -> tuple[Mesh, ...]:
    """Cut a mesh, its holes closed, into convex pieces; those that it was cut into before come from a cache.

    Args:
        mesh: The mesh.
        settings: How to cut it, ``SETTINGS`` or ``REMESHED``.
    """
    path = _cache_path(mesh)
    try:
        pieces = _load(path)
    except UserError:
        pieces = _decompose(close_holes(mesh), settings)
        _save(path, pieces)
    return pieces


def _decompose(mesh: Mesh, settings: dict[str, Any]) -> tuple[Mesh, ...]:
    # Not at the top: loading it takes a second, and shipped assets never need it.
    import coacd

    coacd.set_log_level("error")
    logger.info("cutting a mesh of %d faces into convex pieces", len(mesh.faces))
    found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **settings)
    if len(found) <= FEW_PIECES:
        finer = settings | {"max_ch_vertex": VERTICES_OF_FEW}
        found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **finer)
    return tuple(Mesh(np.asarray(vertices, float), np.asarray(faces, np.int64)) for vertices, faces in found)


def _cache_path(mesh: Mesh) -> Path:
    mesh = close_holes(mesh)
    digest = hashlib.sha256(
        json.dumps([SETTINGS, FEW_PIECES, VERTICES_OF_FEW, version("coacd")], sort_keys=True).encode()
    )
    digest.update(np.ascontiguousarray(mesh.vertices, "<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, "<i8").tobytes())
    return cache_folder() / "pieces" / f"{digest.hexdigest()[:32]}.npz"


def _save(path: Path, pieces: tuple[Mesh, ...]) -> None:
    arrays = {
        "vertex_counts": np.array([len(piece.vertices) for piece in pieces]),
        "face_counts": np.array([len(piece.faces) for piece in pieces]),
        "vertices": np.concatenate([piece.vertices for piece in pieces]),
        "faces": np.concatenate([piece.faces for piece in pieces]),
    }
    save_arrays(path, FORMAT, VERSION, arrays)


def _load(path: Path) -> tuple[Mesh, ...]:
    arrays = load_arrays(path, FORMAT, VERSION)
    try:
        vertices = np.split(arrays["vertices"], np.cumsum(arrays["vertex_counts"])[:-1])
        faces = np.split(arrays["faces"], np.cumsum(arrays["face_counts"])[:-1])
    except (KeyError, TypeError) as error:
        raise UserError(f"{path}: expected pieces, found none: {error}") from None
    return tuple(Mesh(v, f) for v, f in zip(vertices, faces, strict=True))
