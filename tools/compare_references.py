"""Compare references of an object from different sources, such as synthesised and recorded ones.

    python tools/compare_references.py OBJECT FILE [--most N] [--trials N] [--threads N]

Those that the object has among the assets stand beside those of FILE, by kind and hands: how many there are, how deep
hands are in the object, how many links touch it, and how often PD+IK opens or lifts the free object with them. Of each
row N references are measured, spread evenly. Synthesise FILE with --untested: references that were kept because PD+IK
works with them would tell nothing. Success has its 95 % interval over references.
"""

import argparse
from pathlib import Path

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.cli.output import show, show_columns
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.evaluation.reference_check import check_references
from artigrasp.evaluation.statistics import estimate_mean
from artigrasp.kernels.layout import HANDS
from artigrasp.references.quality import CONTACT_DISTANCE, pose_references
from artigrasp.references.reference import ReferenceSet, load_references, read_references
from artigrasp.references.synthesis.grip import GRIPS

COLUMNS = ("kind", "references", "found", "measured", "deepest mm: median, 90 %", "links that touch", "PD+IK")


def of_grip(references: ReferenceSet, name: str) -> np.ndarray:
    """Rows of references of a kind in which just its hands take part."""
    grip = GRIPS[name]
    taking = [side in grip.sides for side in HANDS]
    return np.flatnonzero((references.kind == grip.kind) & (references.active == taking).all(axis=1))


def measure(references: ReferenceSet, trials: int, simulator: SimulatorConfig) -> tuple[str, str, str]:
    """Depths, contacts and success of references of one kind."""
    hands = (load_hand(references.hand, HANDS[0]), load_hand(references.hand, HANDS[1]))
    posed = pose_references(references, load_object(references.object), hands, "cpu")
    posed.launch()
    gaps = posed.link_distance.numpy()[references.active]  # [hand that takes part, link, part]
    row = np.repeat(np.arange(len(references)), references.active.sum(axis=1))
    depth, touching = np.zeros(len(references)), np.zeros(len(references))
    np.maximum.at(depth, row, -1000 * gaps.min(axis=(1, 2)))
    np.add.at(touching, row, (gaps.min(axis=2) < CONTACT_DISTANCE).sum(axis=1))
    found = check_references(references, trials=trials, simulator=simulator)
    rate = estimate_mean(found.success, np.arange(len(references)))
    low, high = max(0.0, rate.low or 0.0), min(1.0, rate.high if rate.high is not None else 1.0)
    depths = f"{np.median(depth):.1f}, {np.quantile(depth, 0.9):.1f}"
    return depths, f"{touching.mean():.1f}", f"{rate.value:.2f} [{low:.2f}, {high:.2f}]"


def main() -> None:
    """Measure and show."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("object")
    parser.add_argument("file", type=Path)
    parser.add_argument("--most", type=int, default=24)
    parser.add_argument("--trials", type=int, default=3, help="angles to open to, or targets to carry to, of each")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    start_warp()
    simulator = SimulatorConfig(threads=options.threads)
    sources = {
        "assets": load_references(options.object),
        options.file.parent.parent.name: read_references(options.file),
    }
    table: list[tuple[str, ...]] = [COLUMNS]
    for name in GRIPS:
        for source, references in sources.items():
            rows = of_grip(references, name)
            if not len(rows):
                continue
            spread = rows[np.unique(np.linspace(0, len(rows) - 1, options.most).round().astype(int))]
            measured = measure(references.select(indices=spread), options.trials, simulator)
            table.append((name, source, str(len(rows)), str(len(spread)), *measured))
    show_columns(table)
    show(f"{options.object}, {options.trials} trials of each reference")


if __name__ == "__main__":
    main()
