"""A training run's folder: what was asked for, how it went, and what came out."""

import contextlib
import importlib.metadata
import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TypeVar

from artigrasp.config import CurriculumConfig, SimulatorConfig, TaskConfig, from_dict, to_dict
from artigrasp.errors import UserError
from artigrasp.files import check_target, read_json, write_json

if sys.platform != "win32":
    import fcntl

RUN_FORMAT, RUN_VERSION = "artigrasp.run", 1
CURRICULUM_FORMAT, CURRICULUM_VERSION = "artigrasp.curriculum-run", 1
RUN_FILE, CURRICULUM_FILE = "run.json", "curriculum.json"


@dataclass(frozen=True)
class RunDescription:
    """What is trained on what; a run that is resumed keeps it."""

    task: TaskConfig
    objects: tuple[str, ...]
    split: str
    """Split whose references are played."""
    seed: int
    evaluation_split: str | None = None
    """Split that evaluations during the training play; the same if None."""


@dataclass(frozen=True)
class CurriculumDescription:
    """What a run of several stages trains on what; each stage has a run folder of its own in the run's."""

    curriculum: CurriculumConfig
    objects: tuple[str, ...]
    split: str
    seed: int
    evaluation_split: str | None = None

    def stage(self, index: int) -> RunDescription:
        """One of its stages as a run."""
        task = self.curriculum.stages[index]
        return RunDescription(task, self.objects, self.split, self.seed, self.evaluation_split)

    def stage_folder(self, folder: Path, index: int) -> Path:
        """Run folder of a stage in that of the curriculum."""
        return folder / f"{index + 1}-{self.curriculum.stages[index].name}"

    def starts(self, folder: Path, index: int) -> list[Path]:
        """Folders of the stages whose networks a stage begins with, the oldest first."""
        stages = self.curriculum.stages
        newest = {name: earlier for earlier in range(index) for name in stages[earlier].networks}
        chosen = sorted({newest[name] for name in stages[index].networks if name in newest})
        return [self.stage_folder(folder, earlier) for earlier in chosen]


def new_run_folder(root: Path, name: str) -> Path:
    """``root/<name>/<time>``, not made yet; a number is added if that is taken."""
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    folder = root / name / stamp
    count = 1
    while folder.exists():
        count += 1
        folder = root / name / f"{stamp}_{count}"
    return folder


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes from training in a folder, which is made; the lock goes with this process.

    Folders that were made here and that nothing was written to are removed again. Windows has no such lock, and nothing
    is kept out there.

    Raises:
        UserError: Another process does, or the folder cannot be made.
    """
    check_target(folder / RUN_FILE)
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        stack.callback(_remove_empty, missing)
        if sys.platform != "win32":
            handle = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, handle)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise UserError(
                    f"{folder}: expected a folder of its own for a run, found another process there"
                ) from error
        yield


def _remove_empty(folders: Iterable[Path]) -> None:
    """Remove folders, the innermost first, up to one in which there is something."""
    with contextlib.suppress(OSError):
        for folder in folders:
            folder.rmdir()


def write_run_description(folder: Path, run: RunDescription, simulator: SimulatorConfig) -> None:
    """Write ``run.json``: the task in full, what it is trained on and where, versions and the commit of the program."""
    description = {
        "format": RUN_FORMAT,
        "version": RUN_VERSION,
        "objects": list(run.objects),
        "split": run.split,
        "seed": run.seed,
        "evaluation_split": run.evaluation_split,
        **asdict(simulator),
        "commit": _git_commit(),
        "packages": {
            name: importlib.metadata.version(name)
            for name in ("artigrasp", "newton", "mujoco", "warp-lang", "torch", "rsl-rl-lib")
        },
        "task": to_dict(run.task),
    }
    write_json(folder / RUN_FILE, description)


def read_run_description(folder: Path) -> RunDescription:
    """Read what a run trains.

    Raises:
        UserError: There is no run in the folder, or its ``run.json`` is malformed or newer than this program.
    """
    return _read_description(RunDescription, folder / RUN_FILE, RUN_FORMAT, RUN_VERSION)


def write_curriculum_description(folder: Path, run: CurriculumDescription) -> None:
    """Write ``curriculum.json``; what each stage ran with is in its ``run.json``."""
    content = {"format": CURRICULUM_FORMAT, "version": CURRICULUM_VERSION, **to_dict(run)}
    write_json(folder / CURRICULUM_FILE, content)


def read_curriculum_description(folder: Path) -> CurriculumDescription:
    """Read what a run of several stages trains.

    Raises:
        UserError: As for :func:`read_run_description`.
    """
    return _read_description(CurriculumDescription, folder / CURRICULUM_FILE, CURRICULUM_FORMAT, CURRICULUM_VERSION)


Description = TypeVar("Description", RunDescription, CurriculumDescription)


def _read_description(kind: type[Description], path: Path, format: str, version: int) -> Description:
    content = read_json(path, format, version, "the description of a run")
    known = {field.name: content[field.name] for field in fields(kind) if field.name in content}
    return from_dict(kind, known, source=str(path))


def _git_commit() -> str:
    """Commit of the checkout that the program runs from, or "unknown" for an installed package."""
    git = ["git", "-C", str(Path(__file__).parent)]
    try:
        # an installed package may lie inside somebody else's checkout
        subprocess.run([*git, "ls-files", "--error-unmatch", Path(__file__).name], capture_output=True, check=True)
        describe = [*git, "describe", "--always", "--dirty", "--abbrev=40"]
        return subprocess.run(describe, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
