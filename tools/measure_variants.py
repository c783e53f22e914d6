"""Train on more and more variants of the open set's categories, and measure on variants and categories never seen.

    artigrasp synthesize-references VARIANTS --kinds articulate-right --count 8 --candidates 12 --untested --out FOLDER
    ARTIGRASP_ASSETS=FOLDER python -m tools.measure_variants [--task NAME] [--counts 1 2 4 8]
        [--unseen 1000 1001 1002 1003] [--left-out CATEGORY...] [--left-out-count N] [--seeds 0 1 2]
        [--left-out-seeds 0] [--control-steps N] [--worlds N] [--out FOLDER] [--threads N]

VARIANTS are those that are used: OBJECT-1 to OBJECT-8 to learn from and OBJECT-1000 to OBJECT-1003 to measure on, of
the eight objects of the open set, grips as they are fitted, which nobody tried in simulation. A policy for each count
learns from so many variants of every category, all from the same number of control steps; one for each category that is
left out learns from all the others. Both are measured on the unseen variants, 1 rad, right hand, free base, next to the
prior alone. Writes variants.md and variants.png into the folder, and prints the tables. What is done is not done again.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from artigrasp.assets.open_set.catalogue import PAPER_CATEGORIES, object_name
from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.files import atomic_write, write_text
from tools.arms import Arm, Measured, Protocol, measure
from tools.exits import exits_on_error

PRIOR = "prior"


def variants(seeds: Sequence[int], categories: Sequence[str] = PAPER_CATEGORIES) -> tuple[str, ...]:
    """Variants of categories."""
    return tuple(object_name(category, seed) for seed in seeds for category in categories)


def of_count(count: int) -> str:
    """Name of the policy that learns from so many variants of every category."""
    return f"{count}-of-each"


def without(category: str) -> str:
    """Name of the policy that never sees a category."""
    return f"without-{category}"


def arms(options: argparse.Namespace) -> list[Arm]:
    """The prior, then a policy for each count."""
    unseen = variants(options.unseen)
    trained = [Arm(of_count(count), options.task, variants(range(1, count + 1)), unseen) for count in options.counts]
    return [Arm(PRIOR, options.task, (), unseen), *trained]


def left_out_arms(options: argparse.Namespace) -> list[Arm]:
    """A policy for each category that is left out."""
    seeds, found = range(1, options.left_out_count + 1), []
    for category in options.left_out:
        others = tuple(each for each in PAPER_CATEGORIES if each != category)
        found.append(
            Arm(without(category), options.task, variants(seeds, others), variants(options.unseen, (category,)))
        )
    return found


def count_table(measured: Mapping[str, Measured]) -> str:
    """Success on unseen variants by how many were learned from."""
    prior, *counts = measured.values()
    rows = [["0, prior alone", "", "", format_estimate(prior.rate()), "", "", "", ""]]
    for each in counts:
        count = int(each.name.split("-")[0])
        gains = [format_estimate(each.gain(other)) if each is not other else "" for other in (prior, counts[0])]
        seeds = ", ".join(f"{value:.3f}" for value in each.success.mean(axis=1))
        angle, cpu = format_estimate(each.mean(each.angle_error)), f"{np.mean(each.cpu_times) / 60:.1f}"
        rows.append([str(count), str(8 * count), seeds, format_estimate(each.rate()), *gains, angle, cpu])
    heads = ["variants of each category", "objects", "Suc.A of each seed", "Suc.A paper", "less the prior"]
    return markdown_table([*heads, f"less {counts[0].name if counts else ''}", "AAE rad", "CPU min a seed"], rows)


def left_out_table(
    measured: Mapping[str, Measured], others: Mapping[str, Measured], options: argparse.Namespace
) -> str:
    """Success on unseen variants of a category, by policies that have seen others of it and that have not."""
    rows = []
    for category in options.left_out:
        if without(category) not in others:
            continue
        unseen = variants(options.unseen, (category,))
        prior, seen = (measured[name].only(unseen) for name in (PRIOR, of_count(options.left_out_count)))
        alone = others[without(category)]
        rates = [format_estimate(each.rate()) for each in (prior, seen, alone)]
        rows.append([category, str(len(alone.reference)), *rates, format_estimate(alone.gain(seen))])
    heads = ["category", "grips", "prior alone", "other variants of it seen", "never seen", "never seen less seen"]
    return markdown_table(heads, rows)


def plot(measured: Mapping[str, Measured], path: Path) -> None:
    """Success over the number of variants, with its interval, and each seed as a dot."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot()
    prior, *counts = measured.values()
    rate = prior.rate()
    axes.axhspan(rate.low or 0.0, rate.high or 0.0, color="C1", alpha=0.15, linewidth=0)
    axes.axhline(rate.value, color="C1", linewidth=1.5, label="prior alone")
    places = [int(each.name.split("-")[0]) for each in counts]
    rates = [each.rate() for each in counts]
    axes.fill_between(places, [each.low or 0.0 for each in rates], [each.high or 0.0 for each in rates], alpha=0.15)
    axes.plot(places, [each.value for each in rates], "o-", color="C0", label="policy, mean of the seeds")
    for place, each in zip(places, counts, strict=True):
        axes.plot(np.full(len(each.seeds), place), each.success.mean(axis=1), "o", color="0.25", markersize=3)
    axes.set_xscale("log", base=2)
    axes.set_xticks(places, [str(place) for place in places])
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel("variants of each category learned from")
    axes.set_ylabel("Suc.A (paper), unseen variants")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)


def main() -> None:
    """Train, measure and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="right-free-replay-firm", help="what is trained, and whose scene is measured")
    parser.add_argument("--counts", nargs="+", type=int, default=[1, 2, 4, 8])
    parser.add_argument("--unseen", nargs="+", type=int, default=[1000, 1001, 1002, 1003])
    parser.add_argument("--left-out", nargs="*", choices=PAPER_CATEGORIES, default=[])
    parser.add_argument("--left-out-count", type=int, default=4, help="variants of each other category; of the counts")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--left-out-seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--control-steps", type=int, default=614_400)
    parser.add_argument("--worlds", type=int, default=128)
    parser.add_argument("--out", type=Path, default=Path("runs/variants"))
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    if options.left_out and options.left_out_count not in options.counts:
        parser.error(f"--left-out-count: expected one of --counts, found {options.left_out_count}")
    protocol = Protocol(options.control_steps, options.worlds, options.task, (1.0,), "train")
    measured: Mapping[str, Measured] = {}
    with exits_on_error(parser):
        for measured in measure(arms(options), options.seeds, protocol, options.out, options.threads):
            write_text(options.out / "variants.md", text := count_table(measured) + "\n")
            plot(measured, options.out / "variants.png")
        for others in measure(left_out_arms(options), options.left_out_seeds, protocol, options.out, options.threads):
            text = count_table(measured) + "\n\n" + left_out_table(measured, others, options) + "\n"
            write_text(options.out / "variants.md", text)
    print(text)


if __name__ == "__main__":
    main()
