"""Put evaluations into the paper's Tables 1 to 3, with the paper's rows beneath ours.

    python -m tools.paper_tables RUN [RUN ...]

Each RUN is a folder that `artigrasp evaluate` has written; baselines and splits in its subfolders are found. What was
not measured stays empty. Table 4, the ablations, is by `tools/measure_ablations.py`.
"""

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import load_run
from artigrasp.evaluation.protocols import EXPERIMENTS
from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.evaluation.statistics import Estimate
from tools.exits import exits_on_error


@dataclass(frozen=True)
class Table:
    """A table of the paper: experiments side by side, and splits one below the other."""

    title: str
    experiments: tuple[str, ...]
    splits: Mapping[str, str]
    """Split, and what is said of its rows."""


TABLES = (
    Table("Table 1: grasping and articulation", ("grasping", "articulation"), {"test": ""}),
    Table("Table 2: the composed task", ("composed",), {"test": ""}),
    Table(
        "Table 3: references from images",
        ("grasping", "articulation"),
        {"recon": "", "recon-mocap": ", references of the same frames from motion capture"},
    ),
)

Measured = Mapping[tuple[str, str, str], Mapping[str, Any]]
"""The contents of `metrics.json` by experiment, split and label."""


def find_runs(folders: Iterable[Path]) -> Measured:
    """All evaluations below some folders.

    Raises:
        UserError: There are none in a folder, one is malformed, or two are of the same.
    """
    found: dict[tuple[str, str, str], Mapping[str, Any]] = {}
    for folder in folders:
        files = sorted(folder.glob("**/metrics.json"))
        if not files:
            raise UserError(f"{folder}: expected evaluations, found none")
        for file in files:
            run = load_run(file.parent)
            metrics = run.metrics
            key = (metrics["experiment"], metrics["split"], run.controller)
            if key in found:
                raise UserError(f"{file.parent}: expected one evaluation of a kind, found two of {' '.join(key)}")
            found[key] = metrics
    return found


def rows_of(table: Table, split: str, measured: Measured) -> list[list[str]]:
    """Our rows of a split, then the paper's."""
    experiments = [EXPERIMENTS[name] for name in table.experiments]
    ours = dict.fromkeys(key[2] for key in measured if key[0] in table.experiments and key[1] == split)
    paper = dict.fromkeys(name for each in experiments for name in each.paper_rows.get(split, {}))
    rows = []
    for label in ours:
        cells = [label + table.splits[split]]
        for each in experiments:
            metrics = measured.get((each.name, split, label))
            values = {} if metrics is None else metrics["protocols"]["paper"]
            cells += [
                format_estimate(Estimate(**values[metric.key])) if values else ""
                for metric in (each.success, *each.metrics)
            ]
            cells += ["" if metrics is None else f"{metrics['trials']} of {metrics['references']}"]
        rows.append(cells)
    for name in paper:
        cells = [f"{name} (paper)" + table.splits[split]]
        for each in experiments:
            row = each.paper_rows.get(split, {}).get(name, {})
            cells += [f"{row[metric.key]:.2f}" if metric.key in row else "" for metric in (each.success, *each.metrics)]
            cells += [""]
        rows.append(cells)
    return rows


def header(table: Table) -> list[str]:
    """Names of the columns."""
    cells = ["model"]
    for name in table.experiments:
        experiment = EXPERIMENTS[name]
        cells += [each.label for each in (experiment.success, *experiment.metrics)] + ["trials, references"]
    return cells


def write_tables(measured: Measured) -> str:
    """All tables in Markdown; success by the paper's criterion, 95 % intervals that count references."""
    parts: list[str] = []
    for table in TABLES:
        rows: Sequence[list[str]] = [row for split in table.splits for row in rows_of(table, split, measured)]
        parts += [f"**{table.title}**", "", markdown_table(header(table), rows), ""]
    return "\n".join(parts)


def main() -> None:
    """Read and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+", metavar="RUN")
    with exits_on_error(parser):
        print(write_tables(find_runs(parser.parse_args().runs)))


if __name__ == "__main__":
    main()
