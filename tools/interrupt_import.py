"""Kill an import of ARCTIC at random moments, and see that nothing is lost and nothing is half there.

    python tools/interrupt_import.py PATH WHOLE [--kills N] [--longest SECONDS] [--seed S] [--cache FOLDER]

imports PATH into a folder of its own over and over, each time killed (SIGKILL, half of the times with the processes
that cut meshes) after a random time, and into another one when it has ended before. After every kill all files that can
be seen must be readable. In the end each import must equal WHOLE, the destination of one that was never interrupted,
file by file, and importing again must change nothing.
Prints one JSON object. With a warm ``--cache`` most kills fall on the writing of files, else on the cutting of meshes.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from artigrasp.arrays import load_plain_arrays
from artigrasp.assets.hand import read_hand
from artigrasp.assets.object import read_object
from artigrasp.references.reference import read_references

STARTING_SECONDS = 1.0
"""Nothing is killed before, for nothing has begun."""


def main() -> None:
    """Kill, and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("path", type=Path)
    parser.add_argument("whole", type=Path, help="destination of an import of PATH that was never interrupted")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--longest", type=float, default=20.0, help="longest time until a kill [s]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", type=Path, help="folder of pieces that were cut before; by default an empty one")
    options = parser.parse_args()
    chance, kills = random.Random(options.seed), 0
    imports: list[Import] = []
    with tempfile.TemporaryDirectory() as name:
        cache = options.cache or Path(name) / "cache"
        while kills < options.kills:
            imports.append(Import(options.path, Path(name) / f"import{len(imports)}", cache))
            kills += imports[-1].interrupt(chance, options.longest, options.kills - kills)
        results = [each.finish(options.whole) for each in imports]
        print(json.dumps({"seed": options.seed, "kills": kills, "imports": results}, indent=2))
    sys.exit(not all(result["equals_uninterrupted"] and result["again_changes_nothing"] for result in results))


class Import:
    """An import of ``path`` into a destination of its own."""

    def __init__(self, path: Path, destination: Path, cache: Path) -> None:
        self._path, self._destination, self._cache = path, destination, cache
        self._files_at_each_kill: list[int] = []

    def interrupt(self, chance: random.Random, longest: float, most: int) -> int:
        """Kill it until it ends before it is killed, or has been killed so often; how often it was killed."""
        while len(self._files_at_each_kill) < most:
            process = self._start()
            kill = os.killpg if chance.random() < 0.5 else os.kill
            try:
                process.communicate(timeout=chance.uniform(STARTING_SECONDS, longest))
                break
            except subprocess.TimeoutExpired:
                kill(process.pid, signal.SIGKILL)
                process.wait()
            self._files_at_each_kill.append(readable_files(self._destination))
        return len(self._files_at_each_kill)

    def finish(self, whole: Path) -> dict[str, Any]:
        """Let it end, import again, and compare with ``whole``."""
        begin = time.perf_counter()
        resumed = json.loads(self._start().communicate()[0])
        seconds = time.perf_counter() - begin
        before = stamps(self._destination)
        again = json.loads(self._start().communicate()[0])
        return {
            "files_at_each_kill": self._files_at_each_kill,
            "files_written_at_last": len(resumed["written"]),
            "seconds_at_last": round(seconds, 1),
            "equals_uninterrupted": contents(self._destination) == contents(whole),
            "again_changes_nothing": not again["written"] and stamps(self._destination) == before,
            "left_over": sorted(path.name for path in self._destination.rglob(".*")),
        }

    def _start(self) -> subprocess.Popen[bytes]:
        """Start it in a session of its own, so that it can be killed with its children."""
        return subprocess.Popen(
            [Path(sys.executable).with_name("artigrasp"), "import-arctic", self._path, "--json"],
            env=os.environ | {"ARTIGRASP_ASSETS": str(self._destination), "ARTIGRASP_CACHE": str(self._cache)},
            stdout=subprocess.PIPE,
            start_new_session=True,
        )


def readable_files(destination: Path) -> int:
    """Read every file that can be seen, and count them."""
    readers = {"hands": read_hand, "objects": read_object, "references": read_references}
    paths = [path for path in destination.rglob("[!.]*") if path.is_file()]
    for path in paths:
        if path.name == "manifest.json":
            json.loads(path.read_text())
        elif path.parent.name == "hands" and path.suffix == ".npz":
            load_plain_arrays(path)
        else:
            readers[path.parent.name](path)
    return len(paths)


def contents(destination: Path) -> dict[str, str]:
    """The hash of every file, as the manifest has it."""
    files = json.loads((destination / "manifest.json").read_text())["files"]
    return {name: entry["content"] for name, entry in files.items()}


def stamps(destination: Path) -> dict[str, int]:
    """When every file was written."""
    return {str(path): path.stat().st_mtime_ns for path in destination.rglob("[!.]*") if path.is_file()}


if __name__ == "__main__":
    main()
