"""`artigrasp compare`: two evaluations trial by trial."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json


@dataclass(frozen=True)
class Options:
    """Compare two evaluations over the trials that both have.

    Differences are paired by trial; their 95 % intervals count references. A folder is one that `artigrasp evaluate`
    wrote, or the subfolder of one of its baselines.

    With --json: {"runs": [folder, folder], "experiment", "trials", "left_out": [only first, only second], "overall":
    {metric: {"first", "second", "difference": {"value", "low", "high", "trials"}}}, "per_object": {name: same}}.
    """

    first: Annotated[Path, tyro.conf.Positional]
    """Folder of an evaluation."""
    second: Annotated[Path, tyro.conf.Positional]
    """Folder of the one to hold against it."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Compare and print."""
    from artigrasp.evaluation.comparison import compare, comparison_table, load_run

    comparison = compare(load_run(options.first), load_run(options.second))
    if options.json:
        show_json(comparison.to_dict())
    else:
        show(comparison_table(comparison).rstrip())
    return 0
