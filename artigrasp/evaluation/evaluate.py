"""Measuring a controller on an experiment's trials."""

import dataclasses
import hashlib
import importlib.metadata
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic

import numpy as np

from artigrasp.config import SimulatorConfig, TaskConfig, to_dict
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.rollout import Planner
from artigrasp.controllers.search import FoundOffsets, SearchController
from artigrasp.controllers.skills import with_skills
from artigrasp.environment.tables import PHASE_LIMITS
from artigrasp.errors import UserError
from artigrasp.evaluation.chunks import FOUND, WHOLE, Columns, Shard, measure_chunks
from artigrasp.evaluation.experiment import Experiment, O, Trials
from artigrasp.kernels.layout import HANDS
from artigrasp.references.reference import ReferenceSet
from artigrasp.simulation.backend import PACKAGES


@dataclass(frozen=True)
class Evaluation(Generic[O]):
    """One controller measured on one set of trials."""

    experiment: Experiment[O]
    task: TaskConfig
    controller: str
    policy: str | None
    rollout_count: int
    """Episodes that the controller tried for each trial before the one that counts."""
    objects: tuple[str, ...]
    split: str
    seed: int
    settings: Mapping[str, Any]
    """Physics settings and versions that the numbers depend on."""
    trials: Trials
    outcomes: O
    wall_time: float
    """Time that measuring took, summed over all processes [s]."""
    found: FoundOffsets | None = None
    """What a search found."""

    @property
    def label(self) -> str:
        """The controller in tables, see :func:`describe_controller`."""
        return describe_controller(self.controller, self.rollout_count, self.experiment.retry_count)


def describe_controller(name: str, rollout_count: int, retry_count: int) -> str:
    """A controller in tables, with its rollouts for each trial if it searches, and its retries if it may try again."""
    counts = {"rollouts": rollout_count, "retries": retry_count}
    return ", ".join([name, *(f"{count} {what}" for what, count in counts.items() if count)])


def evaluate(
    controller: Controller,
    references: Sequence[ReferenceSet],
    experiment: Experiment[O],
    *,
    split: str,
    seed: int = 0,
    policies: Sequence[str] = (),
    per_object: int | None = None,
    world_count: int = 512,
    chunk_folder: Path | None = None,
    shard: Shard = WHOLE,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_trial: Callable[[float, int], None] = lambda done, total: None,
) -> Evaluation[O] | None:
    """Measure a controller on the references of a split.

    Hands start at their pre-grasp poses without noise, so the trials are the same for every controller; the results do
    not depend on how they are cut into chunks, nor on the number of processes.

    Args:
        controller: What acts.
        references: One set per object.
        experiment: What is measured, such as one of the ``experiments`` of
            :func:`artigrasp.evaluation.protocols.get_protocol`.
        split: Split to measure.
        seed: Seed of randomly drawn targets and of the environment.
        policies: Paths of the policy files, for the record.
        per_object: Trials of each object, at most, spread evenly over its references and targets; all by default.
        world_count: Worlds that are simulated at once, at most; a search takes several for each trial.
        chunk_folder: Where finished chunks are kept, so that an evaluation that was stopped can go on, and where
            processes find each other's. The caller removes it.
        shard: Which of the processes this is; they must share the folder.
        simulator: Backend, device and threads.
        on_trial: Called with the number of trials done, in fractions too, and of all.

    Returns:
        The measured trials of all processes, for which the first one waits; None to the others.

    Raises:
        UserError: An object has no reference of the split and the experiment's kinds for the scene's hands, or the
            controller searches where the experiment has no objective.
    """
    if isinstance(controller, SearchController):
        if not experiment.objectives:
            raise UserError(f"controller: expected one that does not search for {experiment.name}, found a search")
        controller = controller.seeking(experiment.objectives)
    chosen = choose_references(references, experiment, split, controller.task)
    trials = experiment.draw_trials(chosen, seed)
    if per_object is not None:
        trials = trials.spread(per_object)
    settings = _protocol_settings(controller, chosen, experiment, simulator)
    parallel = controller.parallel_count if isinstance(controller, Planner) else 1
    stem = None
    if chunk_folder is not None:
        stem = chunk_folder / _fingerprint(settings, controller, chosen, experiment, trials, seed, policies)

    def measure(rows: slice) -> Columns:
        part = trials[rows]
        names = set(part.object.tolist())
        began = time.perf_counter()
        outcomes = experiment.run_trials(
            controller,
            [each for each in chosen if each.object in names],
            part,
            seed=seed,
            simulator=simulator,
            on_step=lambda done, total: on_trial(rows.start + len(part) * done / total, len(trials)),
        )
        arrays = {**outcomes.columns(), "wall_time": np.array([time.perf_counter() - began])}
        if isinstance(controller, SearchController) and controller.found is not None:
            arrays |= {FOUND + name: values for name, values in vars(controller.found).items()}
        return arrays

    columns = measure_chunks(
        measure,
        len(trials),
        max(1, world_count // parallel),
        experiment.outcomes,
        stem=stem,
        shard=shard,
        on_trial=on_trial,
    )
    if columns is None:
        return None
    found = {name.removeprefix(FOUND): columns.pop(name) for name in list(columns) if name.startswith(FOUND)}
    return Evaluation(
        experiment=experiment,
        task=controller.task,
        controller=controller.name,
        policy=" and ".join(policies) or None,
        rollout_count=controller.rollout_count,
        objects=tuple(each.object for each in chosen),
        split=split,
        seed=seed,
        settings=settings,
        trials=trials,
        wall_time=float(columns.pop("wall_time").sum()),
        outcomes=experiment.outcomes(**columns),
        found=FoundOffsets(**found) if found else None,
    )


def choose_references(
    references: Sequence[ReferenceSet], experiment: Experiment[Any], split: str, task: TaskConfig
) -> list[ReferenceSet]:
    """Those that an experiment plays: of its kinds and a split, for hands that are in its scene.

    Raises:
        UserError: An object has none.
    """
    hands = HANDS if experiment.sequence else task.hands
    return [each.select(split=split, kind=experiment.kinds, hands=hands) for each in references]


def _protocol_settings(
    controller: Controller, references: Sequence[ReferenceSet], experiment: Experiment[Any], simulator: SimulatorConfig
) -> dict[str, object]:
    """What the numbers depend on besides the controller: the scene, its physics, package versions and retries."""
    task = controller.task
    return {
        "hand": references[0].hand,
        "hands": list(task.hands),
        "base": "fixed" if task.fixed_base else "free",
        "episode_steps": task.episode_steps,
        "backend": simulator.backend,
        **to_dict(task.physics),
        **{name: importlib.metadata.version(name) for name in PACKAGES},
        **({"retries": experiment.retry_count} if experiment.retry_count else {}),
    }


def _fingerprint(
    settings: Mapping[str, object],
    controller: Controller,
    references: Sequence[ReferenceSet],
    experiment: Experiment[O],
    trials: Trials,
    seed: int,
    policies: Sequence[str],
) -> str:
    """Short name of everything that a trial's outcome depends on: a chunk of another evaluation is not taken up."""
    words = {
        "experiment": experiment.name,
        "outcomes": [each.name for each in dataclasses.fields(experiment.outcomes)],
        "task": to_dict(controller.task),
        "controller": controller.name,
        "settings": settings,
        "sequence": [to_dict(phase) for phase in with_skills(experiment.sequence, controller)],
        "phase_limits": PHASE_LIMITS,
        "artigrasp": importlib.metadata.version("artigrasp"),
        "seed": seed,
    }
    if isinstance(controller, SearchController):
        words["search"] = [repr(controller.settings), repr(controller.objectives), controller.seed]
    digest = hashlib.sha256(json.dumps(words, sort_keys=True).encode())
    for policy in policies:
        if (path := Path(policy)).is_file():
            digest.update(path.read_bytes())
    for columns in ({"object": trials.object, "reference": trials.reference, **trials.targets}, *map(vars, references)):
        for name, values in columns.items():
            digest.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]
