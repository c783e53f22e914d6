"""What failures look like: trials that did not succeed, simulated once more to keep their motions."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.environment.worlds import DRAW_GOAL
from artigrasp.evaluation.evaluate import Evaluation, choose_references
from artigrasp.motion.generate import generate
from artigrasp.motion.motion import Motion
from artigrasp.references.reference import ReferenceSet, join_references


@dataclass(frozen=True)
class Failure:
    """A trial that did not succeed."""

    trial: int
    """Its number, from 0, as the rows of `trials.csv` count."""
    cause: str
    """What went wrong, empty where that is not known."""
    motion: Motion


def choose_failures(evaluation: Evaluation[Any], per_object: int) -> NDArray[np.int64]:
    """Trials of each object that are no success by the paper's criterion: one of each cause first, common ones before.

    Args:
        evaluation: What was measured.
        per_object: How many of each object, at most.
    """
    outcomes = evaluation.outcomes
    failed = np.flatnonzero(~evaluation.experiment.criteria["paper"](outcomes))
    chosen: list[int] = []
    for name in dict.fromkeys(outcomes.object[failed].tolist()):
        rows = failed[outcomes.object[failed] == name].tolist()
        causes = [str(outcomes.cause[row]) for row in rows]
        common, seen, order = Counter(causes), Counter[str](), []
        for row, cause in zip(rows, causes, strict=True):
            order.append((seen[cause], -common[cause], row))
            seen[cause] += 1
        chosen += [row for *_, row in sorted(order)[:per_object]]
    return np.array(chosen, dtype=np.int64)


def replay_failures(
    evaluation: Evaluation[Any],
    controller: Controller,
    references: Sequence[ReferenceSet],
    per_object: int,
    *,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_failure: Callable[[int, int], None] = lambda done, total: None,
) -> list[Failure]:
    """Simulate failures of each object once more, which go as they went, and record them.

    Args:
        evaluation: What was measured.
        controller: What was measured; it must not search.
        references: Those that it was given.
        per_object: How many of each object, at most, see :func:`choose_failures`.
        simulator: Backend, device and threads.
        on_failure: Called with the number of failures that are done and of all.
    """
    measured = [each for each in references if each.object in evaluation.objects]
    chosen = choose_references(measured, evaluation.experiment, evaluation.split, evaluation.task)
    sets = {each.object: each for each in chosen}
    rows = choose_failures(evaluation, per_object)
    failures = []
    for done, row in enumerate(rows.tolist()):
        on_failure(done, len(rows))
        trial = {name: values[row] for name, values in evaluation.trials.targets.items()}
        played, first = sets[str(evaluation.trials.object[row])], int(evaluation.trials.reference[row])
        reference, whole = played.select(indices=[first]), {}
        if evaluation.experiment.sequence:
            second = int(trial.get("second_reference", first))
            reference = join_references([reference, played.select(indices=[second])])
            experiment = evaluation.experiment
            whole = {"sequence": experiment.sequence, "target_offset": trial["target_offset"]}
            whole["retry_count"] = experiment.retry_count
        motion = generate(
            controller,
            reference,
            float(trial.get("goal_angle", DRAW_GOAL)),
            **whole,
            seed=evaluation.seed,
            simulator=simulator,
        )
        failures.append(Failure(row, str(evaluation.outcomes.cause[row]), motion))
    on_failure(len(rows), len(rows))
    return failures
