"""Draw learning curves of one or several runs, seeds as bands.

    python tools/plot_learning_curves.py OUT NAME=RUN[,RUN...] [NAME=RUN...] [--evaluations] [--axes AXIS...]

RUN is a run folder of `artigrasp train`, or that of a curriculum, whose stages are drawn one after the other. Runs of
one name are seeds: a line is their mean, its band goes from the least to the largest. Drawn are success, lifting,
reward and angle error while exploring; with --evaluations what was measured without exploration between iterations.
An AXIS is control_steps, wall_time or cpu_time: a row of panels each, by default the first two. A table of where each
run ended is printed.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from artigrasp.errors import UserError
from artigrasp.training.evaluation import read_evaluations
from artigrasp.training.learning_curve import AXES, EVALUATED, QUANTITIES, join_stages, plot_curves, read_curve
from artigrasp.training.run_folder import CURRICULUM_FILE, read_curriculum_description
from tools.exits import exits_on_error


def read_run(folder: Path, evaluations: bool) -> list[Any]:
    """The points of a run, or of all stages of a curriculum.

    Raises:
        UserError: There are none.
    """
    read = read_evaluations if evaluations else read_curve
    folders = [folder]
    if (folder / CURRICULUM_FILE).is_file():
        run = read_curriculum_description(folder)
        folders = [run.stage_folder(folder, index) for index in range(len(run.curriculum.stages))]
    points = join_stages([read(each) for each in folders])
    if not points:
        raise UserError(f"{folder}: expected a run with a learning curve, found none")
    return points


def named_runs(words: Sequence[str], evaluations: bool) -> dict[str, list[list[Any]]]:
    """The curves of every NAME=RUN[,RUN...].

    Raises:
        UserError: A word is of another form, or names no run.
    """
    runs = {}
    for word in words:
        name, separator, folders = word.partition("=")
        if not separator:
            raise UserError(f"{word}: expected NAME=RUN[,RUN...], found no =")
        runs[name] = [read_run(Path(folder), evaluations) for folder in folders.split(",")]
    return runs


def main() -> None:
    """Draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("runs", nargs="+", metavar="NAME=RUN[,RUN...]")
    parser.add_argument("--evaluations", action="store_true")
    parser.add_argument("--axes", nargs="+", choices=AXES, default=["control_steps", "wall_time"])
    parser.add_argument("--title", default="")
    options = parser.parse_args()
    quantities = EVALUATED if options.evaluations else QUANTITIES
    with exits_on_error(parser):
        runs = named_runs(options.runs, options.evaluations)
        plot_curves(options.out, runs, options.title, options.axes, quantities)
    print("| run | iterations | control steps | CPU h |", " | ".join(quantities), "|")
    print("| --- " * (4 + len(quantities)) + "|")
    for name, curves in runs.items():
        for curve in curves:
            last = curve[-1]
            values = " | ".join(f"{getattr(last, each):.3f}" for each in quantities)
            print(f"| {name} | {last.iteration} | {last.control_steps:,} | {last.cpu_time / 3600:.2f} | {values} |")


if __name__ == "__main__":
    main()
