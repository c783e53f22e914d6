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
import trimesh

from artigrasp.arrays import load_arrays, save_arrays
from artigrasp.assets.object_model import Mesh
from artigrasp.errors import UserError

logger = logging.getLogger(__name__)

FORMAT, VERSION = "artigrasp.pieces", 1
SETTINGS: dict[str, Any] = {
    "threshold": 0.02,
    "max_convex_hull": 32,
    "decimate": True,
    "max_ch_vertex": 40,
    "seed": 0,
}
REMESHED: dict[str, Any] = {"preprocess_mode": "on", "preprocess_resolution": 70}
AS_IS: dict[str, Any] = {"preprocess_mode": "off"}
"""A watertight mesh is cut as it is; any other is first made one, which thickens it a little and takes minutes."""


def cache_folder() -> Path:
    """Where results that can be computed again are kept: ``$ARTIGRASP_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("ARTIGRASP_CACHE")
    return Path(chosen).expanduser() if chosen else platformdirs.user_cache_path("artigrasp")


def convex_pieces(mesh: Mesh) -> tuple[Mesh, ...]:
    """Cut a mesh into convex pieces of at most 40 vertices each, from the cache where it was cut before."""
    settings = SETTINGS | (AS_IS if _trimesh(mesh).is_watertight else REMESHED)
    path = cache_folder() / "pieces" / f"{_digest(mesh, settings)}.npz"
    try:
        pieces = _load(path)
    except UserError:
        pieces = _decompose(mesh, settings)
        _save(path, pieces)
    return pieces


def volume_ratio(mesh: Mesh, pieces: tuple[Mesh, ...], cells: int = 250_000) -> float:
    """Volume of the union of the pieces over the volume of the mesh, to about 1 %: 1 is a perfect fit.

    Args:
        mesh: A watertight mesh.
        pieces: Convex pieces of it.
        cells: Size of the grid on which the union is measured.
    """
    corners = np.concatenate([piece.vertices for piece in pieces])
    low, extents = corners.min(axis=0), np.ptp(corners, axis=0)
    edge = (extents.prod() / cells) ** (1 / 3)
    shape = np.ceil(extents / edge).astype(int)
    # One point at a random place of each cell: a regular grid would over- or undercount walls that are parallel to it.
    points = low + edge * (np.moveaxis(np.indices(shape), 0, -1) + np.random.default_rng(0).random((*shape, 3)))
    inside = np.zeros(shape, bool)
    for piece in pieces:
        hull = trimesh.convex.convex_hull(piece.vertices)
        start = ((hull.bounds[0] - low) / edge - 1).astype(int).clip(0)
        block = tuple(map(slice, start, ((hull.bounds[1] - low) / edge + 2).astype(int)))
        within = np.ones(points[block].shape[:3], bool)
        for normal, corner in zip(hull.face_normals, hull.triangles[:, 0], strict=True):
            within &= points[block] @ normal <= corner @ normal
        inside[block] |= within
    return float(inside.sum() * edge**3 / abs(_trimesh(mesh).volume))


def _decompose(mesh: Mesh, settings: dict[str, Any]) -> tuple[Mesh, ...]:
    # Not at the top: loading it takes a second, and shipped assets never need it.
    import coacd

    coacd.set_log_level("error")
    logger.info("cutting a mesh of %d faces into convex pieces", len(mesh.faces))
    found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **settings)
    return tuple(Mesh(np.asarray(vertices, float), np.asarray(faces, np.int64)) for vertices, faces in found)


def _digest(mesh: Mesh, settings: dict[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps([settings, version("coacd")], sort_keys=True).encode())
    digest.update(np.ascontiguousarray(mesh.vertices, "<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, "<i8").tobytes())
    return digest.hexdigest()[:32]


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
    vertices = np.split(arrays["vertices"], np.cumsum(arrays["vertex_counts"])[:-1])
    faces = np.split(arrays["faces"], np.cumsum(arrays["face_counts"])[:-1])
    return tuple(Mesh(v, f) for v, f in zip(vertices, faces, strict=True))


def _trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
