"""What a search found in every trial, as a file from which a policy can learn.

A demonstration is a decision, or one for each skill of a sequence: offsets along the synergies of the task that the
file names, from the start that the reference gives. ``success`` says which of them are worth imitating.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array, check_array, load_arrays, save_arrays
from artigrasp.config import TaskConfig, from_dict, to_dict
from artigrasp.environment.action_columns import synergy_directions
from artigrasp.errors import UserError
from artigrasp.evaluation.evaluate import Evaluation

FORMAT, VERSION = "artigrasp.demonstrations", 2
_TARGET = "target_"
"""What the names of the targets' arrays begin with in a file."""


@dataclass(frozen=True)
class Demonstrations:
    """Decisions of a search; arrays are indexed [trial, ...]."""

    task: TaskConfig
    """The task that they are decisions in, whose action says what a unit of each offset is."""
    object: NDArray[np.str_]
    source: NDArray[np.str_]
    """Where the reference came from, which names it among those of its object."""
    targets: Mapping[str, NDArray[Any]]
    """What was to be reached, by name, [trial, ...]."""
    offsets: NDArray[np.float32]
    """Offsets of each of the task's hands in units of their scales along the task's directions, in the order of
    ``SYNERGIES``, for each decision of an episode, [trial, decision, hand, direction]."""
    rollouts: NDArray[np.int64]
    """Rollouts until the search was content or had none left, [trial]."""
    success: NDArray[np.bool_]
    """Whether the best of the first rollouts succeeds, [trial, rollout]."""
    error: Array
    """Its error by the objective of the search, [trial, rollout]: rad in articulation, m in grasping."""


def demonstrations_of(evaluation: Evaluation[Any]) -> Demonstrations:
    """The decisions of a controller that searches.

    Raises:
        ValueError: The controller searched for nothing.
    """
    if evaluation.found is None:
        raise ValueError(f"{evaluation.controller}: expected a controller that searches")
    return Demonstrations(
        task=evaluation.task,
        object=evaluation.outcomes.object,
        source=evaluation.outcomes.source,
        targets=evaluation.trials.targets,
        **vars(evaluation.found),
    )


def save_demonstrations(path: Path, demonstrations: Demonstrations) -> None:
    """Write a file of demonstrations, whole or not at all."""
    names = ("object", "source", "offsets", "rollouts", "success", "error")
    arrays = {name: getattr(demonstrations, name) for name in names}
    arrays |= {_TARGET + name: values for name, values in demonstrations.targets.items()}
    save_arrays(path, FORMAT, VERSION, {**arrays, "task": np.array(json.dumps(to_dict(demonstrations.task)))})


def load_demonstrations(path: Path) -> Demonstrations:
    """Read a file of demonstrations.

    Raises:
        UserError: The file is missing, malformed or from a newer version; names the file and the field.
    """
    arrays = load_arrays(path, FORMAT, VERSION)
    sizes: dict[str, int] = {}
    try:
        task = from_dict(TaskConfig, json.loads(str(arrays["task"])), source=f"{path}: task")
        sizes["H"], sizes["D"] = len(task.hands), len(synergy_directions(task.action.synergy))
        return Demonstrations(
            task,
            object=check_array("object", arrays["object"], ("N",), np.str_, sizes),
            source=check_array("source", arrays["source"], ("N",), np.str_, sizes),
            targets={name.removeprefix(_TARGET): values for name, values in arrays.items() if name.startswith(_TARGET)},
            offsets=check_array("offsets", arrays["offsets"], ("N", "S", "H", "D"), np.float32, sizes),
            rollouts=check_array("rollouts", arrays["rollouts"], ("N",), np.int64, sizes),
            success=check_array("success", arrays["success"], ("N", "K"), np.bool_, sizes),
            error=check_array("error", arrays["error"], ("N", "K"), np.float64, sizes),
        )
    except KeyError as error:
        raise UserError(f"{path}: {error.args[0]}: expected an array, found none") from None
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
