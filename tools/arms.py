"""Arms of an experiment: policies that are trained alike, with several seeds each, but for what is compared."""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import Run, load_run
from artigrasp.evaluation.statistics import Estimate, estimate_mean, estimate_rate
from artigrasp.files import read_json, write_json, write_text
from artigrasp.tasks import get_task
from artigrasp.training.run_folder import read_run_description
from artigrasp.training.runner import CHECKPOINT, POLICY

PROGRAM = str(Path(sys.executable).with_name("artigrasp"))
FORMAT, VERSION = "artigrasp.arms", 1


@dataclass(frozen=True)
class Protocol:
    """What all arms have in common; a folder is of one protocol."""

    control_steps: int
    """Of each training."""
    worlds: int
    """Simulated at once."""
    scene: str
    """Task whose hands and base are measured with."""
    goal_angles: tuple[float, ...]
    """To open to [rad]."""
    split: str
    """Of the references that are measured."""

    def keep(self, folder: Path) -> None:
        """Note in a folder's settings.json what its trainings and evaluations share.

        Raises:
            UserError: The folder has been begun otherwise.
        """
        path, asked = folder / "settings.json", {**vars(self), "goal_angles": list(self.goal_angles)}
        if path.is_file():
            found = read_json(path, FORMAT, VERSION, "settings of arms")
            for name, value in asked.items():
                if found.get(name) != value:
                    raise UserError(f"{path}: {name}: expected {value}, found {found.get(name)}: choose another --out")
            return
        write_json(path, {"format": FORMAT, "version": VERSION, **asked})


@dataclass(frozen=True)
class Arm:
    """What is trained, and what it is measured on."""

    name: str
    """A file's name."""
    task: str
    """Task that is trained, or whose prior acts alone."""
    objects: tuple[str, ...]
    """To train on; none if nothing is trained."""
    measured_on: tuple[str, ...]
    """Objects."""


@dataclass(frozen=True)
class Measured:
    """What the seeds of an arm were measured to do, trial by trial."""

    name: str
    seeds: Sequence[int]
    cpu_times: Sequence[float]
    """Of each seed's training [s]."""
    object: NDArray[np.str_]
    """Of each trial, shape [trial]."""
    reference: NDArray[np.str_]
    """What names the reference of each trial, shape [trial]."""
    success: Array
    """By the paper's criterion, shape [seed, trial]."""
    angle_error: Array
    """At the end [rad], shape [seed, trial]."""
    displacement: Array
    """Of the base, mean over the episode [m], shape [seed, trial]."""

    def rate(self) -> Estimate:
        """Success over all seeds and trials."""
        return estimate_rate(self.success.flatten(), self._groups())

    def mean(self, values: Array) -> Estimate:
        """A number of every trial, shape [seed, trial], over all of them."""
        return estimate_mean(values.flatten(), self._groups())

    def gain(self, over: "Measured") -> Estimate:
        """Success less that of another arm, paired by trial and seed; one that has but one seed is paired with all."""
        count = len(self.seeds) if len(over.seeds) == 1 else min(len(self.seeds), len(over.seeds))
        differences = self.success[:count] - over.success[:count]
        return estimate_mean(differences.flatten(), np.tile(self.reference, count))

    def only(self, objects: Sequence[str]) -> "Measured":
        """The trials of some objects."""
        rows = np.isin(self.object, objects)
        arrays = {name: getattr(self, name)[rows] for name in ("object", "reference")}
        arrays |= {name: getattr(self, name)[:, rows] for name in ("success", "angle_error", "displacement")}
        return replace(self, **arrays)

    def _groups(self) -> NDArray[np.str_]:
        return np.tile(self.reference, len(self.seeds))


def train(arm: Arm, seed: int, protocol: Protocol, folder: Path, threads: int) -> Path:
    """The run folder of a training that is done, after doing what is left of it.

    Raises:
        UserError: It has been begun with other objects.
    """
    config = get_task(arm.task)
    steps = config.ppo.steps_per_env * config.action.decision_interval * protocol.worlds
    iterations = str(max(1, round(protocol.control_steps / steps)))
    out = folder / "trainings" / arm.name / f"seed-{seed}"
    runs = [path.parent for path in sorted(out.glob(f"{arm.task}/*/{CHECKPOINT}"))]
    if runs and (found := read_run_description(runs[-1]).objects) != arm.objects:
        raise UserError(f"{runs[-1]}: expected {' '.join(arm.objects)}, found {' '.join(found)}: choose another --out")
    if runs and (runs[-1] / "done").is_file():
        return runs[-1]
    words = ["--objects", *arm.objects, "--seed", str(seed), "--worlds", str(protocol.worlds), "--out", str(out)]
    words = ["--resume", str(runs[-1])] if runs else words
    words = [*words, "--iterations", iterations, "--threads", str(threads), "--json"]
    result = subprocess.run([PROGRAM, "train", arm.task, *words], check=True, stdout=subprocess.PIPE, text=True)
    run_folder = Path(json.loads(result.stdout)["folder"])
    write_text(run_folder / "done", result.stdout)
    return run_folder


def evaluate(arm: Arm, controller: Sequence[str], protocol: Protocol, out: Path, threads: int) -> Run:
    """What a policy, or another controller, does with an arm's objects.

    Raises:
        UserError: Other objects have been evaluated in that folder.
    """
    if not (out / "metrics.json").is_file():
        words = [*controller, "--objects", *arm.measured_on, "--scene", protocol.scene, "--split", protocol.split]
        words += ["--goal-angles", *map(str, protocol.goal_angles), "--threads", str(threads), "--out", str(out)]
        subprocess.run([PROGRAM, "evaluate", "articulation", *words], check=True, stdout=subprocess.DEVNULL)
    run = load_run(out)
    if (found := {key[0] for key in run.trials}) != set(arm.measured_on):
        raise UserError(f"{out}: expected {' '.join(arm.measured_on)}, found {' '.join(found)}: choose another --out")
    return run


def gather(name: str, seeds: Sequence[int], cpu_times: Sequence[float], runs: Sequence[Run]) -> Measured:
    """The seeds of an arm side by side."""
    keys = list(runs[0].trials)
    rows = [[run.trials[key] for key in keys] for run in runs]
    return Measured(
        name,
        seeds,
        cpu_times,
        np.array([key[0] for key in keys]),
        np.array([" ".join(key[:2]) for key in keys]),
        np.array([[float(each["success_paper"] == "True") for each in row] for row in rows]),
        np.array([[float(each["angle_error"]) for each in row] for row in rows]),
        np.array([[float(each["mean_displacement"]) for each in row] for row in rows]),
    )


def measure(
    arms: Sequence[Arm], seeds: Sequence[int], protocol: Protocol, folder: Path, threads: int
) -> Iterator[dict[str, Measured]]:
    """Train and evaluate arm by arm, one seed of all before the next; what is done is not done again.

    Yields:
        After each, what is measured of every arm so far, by its name.

    Raises:
        UserError: The folder is of another protocol.
        subprocess.CalledProcessError: A training or an evaluation failed.
    """
    protocol.keep(folder)
    done: dict[str, list[tuple[int, float, Run]]] = {}
    for seed in seeds:
        for arm in arms:
            if not arm.objects and seed != seeds[0]:
                continue  # no training, no seed
            spent, controller = 0.0, ["--controller", "zero", "--task", arm.task]
            if arm.objects:
                run_folder = train(arm, seed, protocol, folder, threads)
                spent = json.loads((run_folder / "done").read_text(encoding="utf-8"))["cpu_time"]
                controller = ["--policy", str(run_folder / POLICY)]
            out = folder / "evaluations" / arm.name / f"seed-{seed}"
            done.setdefault(arm.name, []).append((seed, spent, evaluate(arm, controller, protocol, out, threads)))
            yield {name: gather(name, *zip(*rows, strict=True)) for name, rows in done.items()}
