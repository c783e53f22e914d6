"""Train several tasks alike, with several seeds each, and compare what they have learned on references they never saw.

    python -m tools.measure_ablations TASK [TASK...] --objects NAME [NAME...] [--seeds 0 1 2] [--control-steps N]
        [--worlds N] [--scene TASK] [--goal-angles RAD...] [--split NAME] [--out FOLDER] [--threads N]

Every task gets the same number of control steps in the same number of worlds, and is then measured by `artigrasp
evaluate articulation` in one scene. The first task is what the others are compared with. Trainings and evaluations that
are done are not done again, and one that was stopped goes on, but not where settings.json says that the folder is of
other control steps, worlds, scene, goal angles or split; seeds come one after the other, so that there is
something to compare early. Writes comparison.md and comparison.png into the folder, and prints the table. Where a
success has an interval, it is over the trials of all seeds, counting references; how far seeds differ is
shown by itself.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.files import atomic_write, write_text
from tools.arms import Arm, Measured, Protocol, measure
from tools.exits import exits_on_error


def table(measured: Sequence[Measured]) -> str:
    """One row per task."""
    rows = []
    for each in measured:
        gain = "" if each is measured[0] else format_estimate(each.gain(measured[0]))
        seeds = ", ".join(f"{value:.3f}" for value in each.success.mean(axis=1))
        cpu = f"{np.mean(each.cpu_times) / 60:.1f}"
        means = [format_estimate(each.mean(values)) for values in (each.angle_error, each.displacement)]
        rows.append([each.name, format_estimate(each.rate()), gain, seeds, *means, cpu])
    heads = ["task", "Suc.A paper", f"less {measured[0].name}", "of each seed", "AAE rad", "SD m", "CPU min a seed"]
    return markdown_table(heads, rows)


def plot(measured: Sequence[Measured], path: Path) -> None:
    """Success with its interval, and each seed as a dot."""
    figure = Figure(figsize=(8.0, 0.9 + 0.5 * len(measured)), layout="constrained")
    axes = figure.add_subplot()
    for row, each in enumerate(measured):
        rate = each.rate()
        axes.plot(
            np.array([rate.low, rate.high], float), [row, row], color="C0" if row else "C1", linewidth=5, alpha=0.35
        )
        axes.plot(rate.value, row, "|", color="C0" if row else "C1", markersize=16, markeredgewidth=3)
        axes.plot(each.success.mean(axis=1), np.full(len(each.seeds), row), "o", color="0.25", markersize=4)
    axes.set_yticks(range(len(measured)), [each.name for each in measured])
    axes.set_ylim(len(measured) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("Suc.A (paper), 95 % over references; dots are seeds")
    axes.grid(axis="x", alpha=0.3)
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)


def main() -> None:
    """Train, measure and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="+")
    parser.add_argument("--objects", nargs="+", required=True)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--control-steps", type=int, default=1_228_800)
    parser.add_argument("--worlds", type=int, default=256)
    parser.add_argument("--scene", default="both-free")
    parser.add_argument("--split", default="test")
    parser.add_argument("--goal-angles", nargs="+", type=float, default=[1.0])
    parser.add_argument("--out", type=Path, default=Path("runs/ablations"))
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    objects = tuple(options.objects)
    arms = [Arm(task, task, objects, objects) for task in options.tasks]
    protocol = Protocol(options.control_steps, options.worlds, options.scene, tuple(options.goal_angles), options.split)
    with exits_on_error(parser):
        for measured in measure(arms, options.seeds, protocol, options.out, options.threads):
            text = table(list(measured.values())) + "\n"
            write_text(options.out / "comparison.md", text)
            plot(list(measured.values()), options.out / "comparison.png")
    print(text)


if __name__ == "__main__":
    main()
