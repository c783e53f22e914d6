"""Cutting many meshes into convex pieces at once, each in a process that may fail."""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from artigrasp.assets.decomposition import REMESHED, SETTINGS, convex_pieces, is_cut
from artigrasp.assets.object_model import Mesh
from artigrasp.errors import UserError

POLL_SECONDS = 0.1
TIME_LIMIT = 900
"""Processor time after which cutting a mesh is given up [s]; that of a tangled one need not end."""
ATTEMPTS = (SETTINGS, REMESHED)
"""Settings to try one after the other."""


def cut_meshes(meshes: Mapping[str, Mesh], processes: int, progress: Callable[[str], None]) -> None:
    """Cut meshes into convex pieces, which :func:`convex_pieces` then has at once.

    Whatever was cut before is skipped, and what is cut stays: an interrupted run is taken up where it was.

    Args:
        meshes: The meshes, by what to call them.
        processes: Largest number of processes.
        progress: Told the name of each mesh when it is cut.

    Raises:
        UserError: a mesh cannot be cut.
    """
    waiting: list[tuple[str, int]] = []
    for name, mesh in meshes.items():
        if is_cut(mesh):
            progress(name)
        else:
            waiting.append((name, 0))
    running: dict[tuple[str, int], subprocess.Popen[bytes]] = {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            while waiting or running:
                while waiting and len(running) < processes:
                    name, attempt = waiting.pop(0)
                    running[name, attempt] = _start(meshes[name], attempt, Path(folder))
                time.sleep(POLL_SECONDS)
                for name, attempt in [key for key, process in running.items() if process.poll() is not None]:
                    process = running.pop((name, attempt))
                    # Whether the pieces are there counts, not how the process ended.
                    if is_cut(meshes[name]):
                        progress(name)
                    elif attempt + 1 < len(ATTEMPTS):
                        waiting.insert(0, (name, attempt + 1))
                    else:
                        raise UserError(f"{name}: cannot cut this mesh into convex pieces: {_last_words(process)}")
        finally:
            for process in running.values():
                process.kill()
                process.wait()


def cut_file(path: str, attempt: str) -> None:
    """What each process does: cut the mesh of a file with the settings of an attempt."""
    # Windows has no such limit.
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (TIME_LIMIT, TIME_LIMIT))
    with np.load(path, allow_pickle=False) as arrays:
        convex_pieces(Mesh(arrays["vertices"], arrays["faces"]), ATTEMPTS[int(attempt)])


def _start(mesh: Mesh, attempt: int, folder: Path) -> subprocess.Popen[bytes]:
    path = Path(tempfile.mkdtemp(dir=folder)) / "mesh.npz"
    np.savez(path, vertices=mesh.vertices, faces=mesh.faces)
    code = "import sys; from artigrasp.assets.cutting import cut_file; cut_file(*sys.argv[1:])"
    with _log(path).open("wb") as log:
        return subprocess.Popen(
            # -P: not the package of that name in the folder that the user is in
            [sys.executable, "-P", "-c", code, str(path), str(attempt)],
            env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )


def _log(path: Path) -> Path:
    return path.with_suffix(".log")


def _last_words(process: subprocess.Popen[bytes]) -> str:
    *_, path, _ = process.args  # type: ignore[misc]
    lines = _log(Path(str(path))).read_text(errors="replace").splitlines()
    return next((line.strip() for line in reversed(lines) if line.strip()), f"exit code {process.returncode}")
