"""Kill commands at random moments, and see that no file is half there and nothing that was done is lost.

    python tools/interrupt_commands.py [--verbs train evaluate generate export-usd] [--kills N] [--seed S]

runs each command in a folder of its own over and over, each time killed (SIGKILL); where it has left off it goes on,
and where it has ended it begins anew. Every other kill comes at a random moment, counted in the command's processor
time, which other work on the machine does not stretch; the others in the middle of writing the first file after such a
moment. After every kill all files that can be seen must be readable, and what was done must not have become less:
iterations of a training, chunks of an evaluation, the file that `generate` and `export-usd` were to replace. What ends
must equal what a command made that was never interrupted. Prints one JSON object, and fails if something was lost;
Ctrl-C ends the kills of a verb early, and what was seen until then counts.
Imports have a tool of their own, `interrupt_import.py`.

To spare time commands are forked from a process that has imported their modules already.
"""

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from multiprocessing import get_context, set_forkserver_preload
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf
from rich.progress import track

from artigrasp.arrays import load_plain_arrays
from artigrasp.cli import main as cli_main
from artigrasp.controllers.policy_file import load_policy
from artigrasp.motion.file import load_motion
from artigrasp.training.learning_curve import read_curve

PRELOADED = (
    "artigrasp.cli.app",
    "artigrasp.controllers.library",
    "artigrasp.evaluation.report",
    "artigrasp.export.usd",
    "artigrasp.motion.generate",
    "artigrasp.training.train",
)
"""Modules that commands find imported."""
ITERATIONS = 15
"""Of a training: one takes less than starting does."""
POLL_SECONDS = 0.002
"""Between two looks at a command."""


class Case(ABC):
    """A command that works in a folder.

    Attributes:
        replaces: Whether it replaces what it made before.
    """

    replaces = False

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
    """A training, which is resumed where there is something to resume."""

    def words(self) -> list[str]:
        """See `Case`."""
        runs = [path.parent for path in sorted(self.folder.rglob("latest.pt"))]
        where = ["--resume", str(runs[-1])] if runs else ["--out", str(self.folder), "--worlds", "8"]
        return ["train", "right-fixed-synergy", "--iterations", str(ITERATIONS), *where, "--threads", "1"]

    def progress(self) -> int:
        """See `Case`."""
        return max((load_policy(path).iteration for path in self.folder.rglob("latest.pt")), default=0)

    def result(self) -> object:
        """What is acted with, all that would be resumed from, and the learning curve; without the times it took."""
        (checkpoint,) = self.folder.rglob("latest.pt")
        policy, learned = load_policy(checkpoint.with_name("policy.pt")), load_policy(checkpoint)
        states = [policy.actors, learned.actors, {**(learned.learner or {}), "cpu_time": 0.0}]
        curve = [vars(replace(point, wall_time=0.0, cpu_time=0.0)) for point in read_curve(checkpoint.parent)]
        return as_bytes([*states, curve])


class Evaluate(Case):
    """An evaluation in 12 chunks."""

    def words(self) -> list[str]:
        """See `Case`."""
        out = ["--out", str(self.folder / "evaluation")]
        few = ["--per-object", "12", "--worlds", "1", "--threads", "1"]
        return ["evaluate", "articulation", "--controller", "pd-ik", *few, *out]

    def progress(self) -> int:
        """See `Case`."""
        return len(list(self.folder.rglob("chunks/[!.]*.npz")))

    def result(self) -> str:
        """See `Case`."""
        return (self.folder / "evaluation" / "trials.csv").read_text()


class Generate(Case):
    """One motion, in the place of an older one."""

    replaces = True

    def words(self) -> list[str]:
        """See `Case`."""
        return ["generate", "--controller", "pd-ik", "--out", str(self.folder / "motion.npz"), "--threads", "1"]

    def result(self) -> dict[str, Any]:
        """See `Case`."""
        return {name: array.tolist() for name, array in load_plain_arrays(self.folder / "motion.npz").items()}


class ExportUsd(Case):
    """One motion as USD, in the place of an older one."""

    replaces = True

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._motion = folder.parent / "motion.npz"
        if not self._motion.exists():
            run(["generate", "--controller", "pd-ik", "--out", str(self._motion)]).join()

    def words(self) -> list[str]:
        """See `Case`."""
        return ["export-usd", str(self._motion), "--out", str(self.folder / "motion.usdc")]

    def result(self) -> str:
        """See `Case`."""
        return str(read_layer(self.folder / "motion.usdc").ExportToString())


CASES: dict[str, type[Case]] = {"train": Train, "evaluate": Evaluate, "generate": Generate, "export-usd": ExportUsd}


def main() -> None:
    """Kill, and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--verbs", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    set_forkserver_preload(list(PRELOADED))
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which shells let what they put in the background ignore
    results = {}
    with tempfile.TemporaryDirectory() as name:
        for verb in options.verbs:
            results[verb] = interrupt(verb, Path(name) / verb, options.kills, random.Random(options.seed))
    print(json.dumps({"seed": options.seed, "verbs": results}, indent=2))
    sys.exit(any(result[key] for result in results.values() for key in ("unreadable", "lost", "different")))


def interrupt(verb: str, root: Path, kills: int, chance: random.Random) -> dict[str, int]:
    """Kill a verb so often; what was seen, as counts."""
    found = dict.fromkeys(
        ("kills", "while_writing", "went_on", "ended", "files_seen", "unreadable", "lost", "different"), 0
    )
    whole, longest = uninterrupted(verb, root / "whole")
    case = make(verb, root / "work")
    if case.replaces:
        shutil.copytree(root / "whole", case.folder, dirs_exist_ok=True)
    with contextlib.suppress(KeyboardInterrupt):
        for _ in track(range(kills), verb, transient=True):
            while True:
                before = case.progress()
                if killed(run(case.words()), chance.uniform(0, longest), case.folder if found["kills"] % 2 else None):
                    break
                found["ended"] += 1
                found["different"] += case.result() != whole
                if not case.replaces:
                    shutil.rmtree(case.folder)
                    case = make(verb, case.folder)
            found["kills"] += 1
            found["went_on"] += before > 0
            files = [path for path in case.folder.rglob("*") if path.is_file()]
            found["while_writing"] += any(is_temporary(path) for path in files)
            for path in files:
                if is_temporary(path):
                    path.unlink()  # so that the next one is new
                else:
                    found["files_seen"] += 1
                    found["unreadable"] += not readable(path)
            found["lost"] += case.progress() < before
            found["different"] += case.replaces and case.result() != whole
    return found


def uninterrupted(verb: str, folder: Path) -> tuple[Any, float]:
    """What the verb makes when nobody kills it, and its processor time [s]."""
    case = make(verb, folder)
    process, seconds = run(case.words()), 0.0
    while process.exitcode is None:
        seconds = processor_time(process) or seconds
        time.sleep(0.1)
    if process.exitcode != 0:
        raise RuntimeError(f"{case.words()}: failed with {process.exitcode}")
    return case.result(), seconds


def make(verb: str, folder: Path) -> Case:
    """The case, with its folder."""
    folder.mkdir(parents=True)
    return CASES[verb](folder)


def run(words: list[str]) -> BaseProcess:
    """Start a command without a word on the terminal."""
    process = get_context("forkserver").Process(target=command, args=(words,), daemon=True)
    process.start()
    return process


def command(words: list[str]) -> None:
    """What a process does."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    sys.exit(cli_main(words))


def killed(process: BaseProcess, after: float, folder: Path | None) -> bool:
    """Kill a process after some processor time [s], and then not before it writes to a folder, if one is given.

    Returns:
        Whether it was killed, rather than ended before.

    Raises:
        RuntimeError: It failed by itself.
    """
    while process.exitcode is None:
        writes = folder is None or any(is_temporary(path) for path in folder.rglob(".*"))
        if writes and processor_time(process) >= after:
            process.kill()
            process.join()
            return True
        time.sleep(POLL_SECONDS)
    if process.exitcode != 0:
        raise RuntimeError(f"{process}: failed with {process.exitcode}")
    return False


def processor_time(process: BaseProcess) -> float:
    """What a process has used so far [s]; 0 once it has ended."""
    try:
        text = Path(f"/proc/{process.pid}/stat").read_text()
    except OSError:
        return 0.0
    user, system = text.rsplit(") ", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def as_bytes(state: Any) -> Any:
    """A state with bytes in the place of its numbers, so that what is no number equals itself."""
    if isinstance(state, Mapping):
        return {name: as_bytes(each) for name, each in state.items()}
    if isinstance(state, list | tuple):
        return [as_bytes(each) for each in state]
    return np.asarray(state).tobytes()


def is_temporary(path: Path) -> bool:
    """Whether a file has not got its name yet."""
    return path.name.startswith(".")


def read_layer(path: Path) -> Sdf.Layer:
    """A USD file as it is now, whatever was read at its place before.

    Raises:
        RuntimeError: It is not whole.
    """
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    if layer is None:
        raise RuntimeError(f"{path}: expected USD")
    return layer


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
            read_layer(path)
        elif path.suffix == ".csv":
            rows = path.read_text().splitlines()
            return len({row.count(",") for row in rows if '"' not in row}) == 1
    except Exception:  # whatever a reader stumbles over, the file is not whole; it is counted and fails the tool
        return False
    return True


if __name__ == "__main__":
    main()
