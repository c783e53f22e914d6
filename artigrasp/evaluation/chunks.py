"""An evaluation's trials in chunks, whose files let it be taken up again and shared between processes."""

import dataclasses
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import load_arrays, save_arrays
from artigrasp.errors import UserError
from artigrasp.evaluation.outcomes import Outcomes

CHUNK_FORMAT, CHUNK_VERSION = "artigrasp.evaluation-chunk", 1
FOUND = "found_"
"""What the names of a search's arrays begin with in a chunk."""
_POLL_SECONDS = 0.5

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Shard:
    """One of several processes that share the work, such as the chunks of an evaluation."""

    rank: int = 0
    count: int = 1

    @classmethod
    def from_environment(cls) -> Self:
        """What `torchrun` says in ``RANK`` and ``WORLD_SIZE``; without it, the only one."""
        return cls(int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1)))

    @property
    def is_first(self) -> bool:
        """Whether this one writes the files and reports."""
        return self.rank == 0


WHOLE = Shard()
"""Of an evaluation that one process does alone."""


def measure_chunks(
    measure: Callable[[slice], Columns],
    trial_count: int,
    chunk_size: int,
    outcomes: type[Outcomes],
    *,
    stem: Path | None,
    shard: Shard,
    on_trial: Callable[[float, int], None],
) -> Columns | None:
    """Measure trials chunk by chunk, those whose files are there excepted.

    Args:
        measure: Measures some of the trials: the columns of their outcomes, ``wall_time`` [s], shape [1], and, by names
            that say so, what a search found.
        trial_count: Number of all trials.
        chunk_size: Trials of a chunk, at most.
        outcomes: What is measured of each trial.
        stem: What the paths of the chunks' files begin with; None to keep none.
        shard: Which of the processes this is.
        on_trial: Called with the number of trials done and of all.

    Returns:
        The columns of all trials, for which the first process waits, and ``wall_time`` of every chunk; None to the
        other processes.

    Raises:
        UserError: A file is damaged or of a newer version.
    """
    chunks = [slice(start, min(start + chunk_size, trial_count)) for start in range(0, trial_count, chunk_size)]
    paths = [stem and stem.with_name(f"{stem.name}-{rows.start:06d}-{rows.stop:06d}.npz") for rows in chunks]
    measured: dict[int, Columns] = {}
    for index, (rows, path) in enumerate(zip(chunks, paths, strict=True)):
        if index % shard.count == shard.rank and (path is None or not path.is_file()):
            measured[index] = measure(rows)
            if path is not None:
                save_arrays(path, CHUNK_FORMAT, CHUNK_VERSION, measured[index])
        on_trial(rows.stop, trial_count)
    if not shard.is_first:
        return None
    for index, path in enumerate(paths):
        if path is not None and index not in measured:
            while not path.is_file():
                time.sleep(_POLL_SECONDS)
            measured[index] = load_chunk(path, outcomes, chunks[index].stop - chunks[index].start)
    results = [measured[index] for index in range(len(chunks))]
    return {name: np.concatenate([each[name] for each in results]) for name in results[0]}


def load_chunk(path: Path, outcomes: type[Outcomes], trial_count: int) -> Columns:
    """Read what was measured in a part of an evaluation's trials.

    Args:
        path: The file.
        outcomes: What is measured of each trial.
        trial_count: Number of its trials.

    Returns:
        The columns of the outcomes, the time that they took and, by names that say so, what a search found.

    Raises:
        UserError: The file is damaged or of a newer version.
    """
    arrays = load_arrays(path, CHUNK_FORMAT, CHUNK_VERSION)
    columns = {field.name: field.type for field in dataclasses.fields(outcomes)}
    for name in sorted({*columns, "wall_time", *arrays}):
        if name not in arrays or not (name in columns or name == "wall_time" or name.startswith(FOUND)):
            found = "none" if name not in arrays else "one"
            raise UserError(f"{path}: {name}: expected {'an' if found == 'none' else 'no such'} array, found {found}")
        rows, kinds = (1 if name == "wall_time" else trial_count), "U" if "str_" in str(columns.get(name)) else "biuf"
        if arrays[name].shape[:1] != (rows,) or arrays[name].dtype.kind not in kinds:
            expected = f"{rows} {'texts' if kinds == 'U' else 'numbers'}"
            raise UserError(f"{path}: {name}: expected {expected}, found {arrays[name].dtype} {arrays[name].shape}")
    return arrays
