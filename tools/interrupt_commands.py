"""Kill commands at random moments, and see that no file is half there and nothing that was done is lost.

    python tools/interrupt_commands.py [--verbs train evaluate generate export-usd] [--kills N] [--seed S]

runs each command in a folder of its own over and over, each time killed (SIGKILL) after a random time; where it has
left off it goes on, and where it has ended it begins anew. After every kill all files that can be seen must be
readable, and what was done must not have become less: iterations of a training, chunks of an evaluation. What ends
must equal what a command made that was never interrupted. Prints one JSON object, and fails if something was lost.
Imports have a tool of their own, `interrupt_import.py`.
"""

import argparse
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd
from rich.progress import track

from artigrasp.arrays import load_plain_arrays
from artigrasp.controllers.policy_file import load_policy
from artigrasp.motion.file import load_motion

STARTING_SECONDS = 1.0
"""Nothing is killed before, for nothing has begun."""


class Case(ABC):
    """A command that works in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @abstractmethod
    def words(self) -> list[str]:
        """What to run now, be it anew or to go on."""

    def progress(self) -> int:
        """How much has been done that must never become less."""
        return 0

    @abstractmethod
    def result(self) -> Any:
        """What it made when it ended, for comparison."""


class Train(Case):
    """A training, which is resumed where there is something to resume, and never ends."""

    def words(self) -> list[str]:
        """See `Case`."""
        runs = [path.parent for path in sorted(self.folder.rglob("latest.pt"))]
        where = ["--resume", str(runs[-1])] if runs else ["--out", str(self.folder), "--worlds", "8"]
        return ["train", "right-fixed-synergy", "--iterations", "100000", *where, "--threads", "1"]

    def progress(self) -> int:
        """See `Case`."""
        return max((load_policy(path).iteration for path in self.folder.rglob("latest.pt")), default=0)

    def result(self) -> Any:
        """See `Case`."""
        raise RuntimeError("a training of 100,000 iterations has ended")


class Evaluate(Case):
    """An evaluation in 20 chunks."""

    def words(self) -> list[str]:
        """See `Case`."""
        out = ["--out", str(self.folder / "evaluation")]
        return ["evaluate", "articulation", "--controller", "pd-ik", "--worlds", "3", *out, "--threads", "1"]

    def progress(self) -> int:
        """See `Case`."""
        return len(list(self.folder.rglob("chunks/[!.]*.npz")))

    def result(self) -> str:
        """See `Case`."""
        return (self.folder / "evaluation" / "trials.csv").read_text()


class Generate(Case):
    """One motion."""

    def words(self) -> list[str]:
        """See `Case`."""
        return ["generate", "--controller", "pd-ik", "--out", str(self.folder / "motion.npz"), "--threads", "1"]

    def result(self) -> dict[str, Any]:
        """See `Case`."""
        return {name: array.tolist() for name, array in load_plain_arrays(self.folder / "motion.npz").items()}


class ExportUsd(Case):
    """One motion as USD."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._motion = folder.parent / "motion.npz"
        if not self._motion.exists():
            run(["generate", "--controller", "pd-ik", "--out", str(self._motion)]).wait()

    def words(self) -> list[str]:
        """See `Case`."""
        return ["export-usd", str(self._motion), "--out", str(self.folder / "motion.usdc")]

    def result(self) -> str:
        """See `Case`."""
        return str(Usd.Stage.Open(str(self.folder / "motion.usdc")).GetRootLayer().ExportToString())


CASES: dict[str, type[Case]] = {"train": Train, "evaluate": Evaluate, "generate": Generate, "export-usd": ExportUsd}


def main() -> None:
    """Kill, and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--verbs", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    results = {}
    with tempfile.TemporaryDirectory() as name:
        for verb in options.verbs:
            results[verb] = interrupt(verb, Path(name) / verb, options.kills, random.Random(options.seed))
    print(json.dumps({"seed": options.seed, "verbs": results}, indent=2))
    sys.exit(any(result[key] for result in results.values() for key in ("unreadable", "lost", "different")))


def interrupt(verb: str, root: Path, kills: int, chance: random.Random) -> dict[str, int]:
    """Kill a verb so often; what was seen, as counts."""
    found = dict.fromkeys(
        ("kills", "went_on", "ended", "files_seen", "temporary", "unreadable", "lost", "different"), 0
    )
    case, (whole, longest) = make(verb, root / "work"), uninterrupted(verb, root / "whole")
    for _ in track(range(kills), verb, transient=True):
        before = case.progress()
        found["went_on"] += before > 0
        while not killed(run(case.words()), chance.uniform(STARTING_SECONDS, longest)):
            found["ended"] += 1
            found["different"] += case.result() != whole
            shutil.rmtree(case.folder)
            case, before = make(verb, case.folder), 0
        found["kills"] += 1
        for path in case.folder.rglob("*"):
            if path.is_file():
                found["files_seen"] += 1
                found["temporary"] += path.name.startswith(".")
                found["unreadable"] += not path.name.startswith(".") and not readable(path)
        found["lost"] += case.progress() < before
    return found


def uninterrupted(verb: str, folder: Path) -> tuple[Any, float]:
    """What the verb makes when nobody kills it, and how long it takes [s]; of a training how long two iterations do."""
    case, begin = make(verb, folder), time.perf_counter()
    process = run(case.words())
    while process.poll() is None and not (verb == "train" and case.progress() > 1):
        time.sleep(0.2)
    seconds = time.perf_counter() - begin
    if verb == "train":
        process.kill()
        return None, 1.5 * seconds
    return case.result(), 0.9 * seconds


def make(verb: str, folder: Path) -> Case:
    """The case, with its folder."""
    folder.mkdir(parents=True)
    return CASES[verb](folder)


def run(words: list[str]) -> subprocess.Popen[bytes]:
    """Start a command without a word on the terminal."""
    program = Path(sys.executable).with_name("artigrasp")
    return subprocess.Popen([program, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def killed(process: subprocess.Popen[bytes], after: float) -> bool:
    """Kill a process after some time [s], unless it has ended; whether it was killed.

    Raises:
        RuntimeError: It failed by itself.
    """
    try:
        if process.wait(timeout=after) != 0:
            raise RuntimeError(f"{process.args}: failed with {process.returncode}")
        return False
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
        return True


def readable(path: Path) -> bool:
    """Whether a file is whole, as far as its kind has a reader."""
    try:
        if path.name == "motion.npz":
            load_motion(path)
        elif path.suffix == ".npz":
            np.load(path, allow_pickle=False).close()
        elif path.suffix == ".pt":
            load_policy(path)
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".usdc":
            return bool(Usd.Stage.Open(str(path)))
        elif path.suffix == ".csv":
            rows = path.read_text().splitlines()
            return len({row.count(",") for row in rows if '"' not in row}) == 1
    except Exception:  # whatever a reader stumbles over, the file is not whole; it is counted and fails the tool
        return False
    return True


if __name__ == "__main__":
    main()
