"""Compare synthesised references of objects with those that they have among the assets, such as recorded ones.

    artigrasp synthesize-references OBJECT ... --kinds articulate-right grasp-both --untested --count 24
    python -m tools.compare_references synthesised OBJECT ...

prints the table in `docs/synthesis.md`. Of each kind that an object has from both sources: how many references there
are and of how many fitted hands they were chosen, how deep the deepest point of the hands is in the object, how many
links touch it, and how often PD+IK opens or lifts the free object with them, one trial each. Of either source so many
are measured, at most, spread evenly over all that it has. Synthesise with --untested: that PD+IK works with references
which were kept because it does would tell nothing.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.cli.output import show
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.evaluation.reference_check import check_references
from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.evaluation.statistics import estimate_rate
from artigrasp.kernels.layout import HANDS
from artigrasp.references.quality import CONTACT_DISTANCE, pose_references
from artigrasp.references.reference import ReferenceSet, load_references, read_references
from artigrasp.references.synthesis.grip import GRIPS, Grip

HEADER = (
    *("object", "kind", "references", "there are", "measured"),
    *("deepest mm: median, 90 %", "links that touch", "PD+IK"),
)
FEWEST = 5
"""Of a kind that either source has fewer of than this nothing is measured."""


def of_grip(references: ReferenceSet, grip: Grip, most: int) -> tuple[ReferenceSet, int]:
    """At most so many references of a kind in which just its hands take part, spread evenly, and how many there are."""
    taking = [side in grip.sides for side in HANDS]
    rows = np.flatnonzero((references.kind == grip.kind) & (references.active == taking).all(axis=1))
    spread = np.linspace(0, len(rows) - 1, min(most, len(rows))).round().astype(int)
    return references.select(indices=rows[spread]), len(rows)


def depths_and_contacts(references: ReferenceSet) -> tuple[Array, NDArray[np.int64]]:
    """How deep the deepest point of the hands is in the object [m], and how many of their links touch it, shape [R]."""
    hands = (load_hand(references.hand, HANDS[0]), load_hand(references.hand, HANDS[1]))
    posed = pose_references(references, load_object(references.object), hands, "cpu")
    posed.launch()
    gaps = np.where(references.active[..., None], posed.link_distance.numpy().min(axis=3).astype(np.float64), np.inf)
    return np.maximum(-gaps.min(axis=(1, 2)), 0.0), (gaps < CONTACT_DISTANCE).sum(axis=(1, 2))


def measure(references: ReferenceSet, simulator: SimulatorConfig) -> tuple[str, str, str]:
    """Depths, contacts and success of references of one kind, as the table shows them."""
    depth, touching = depths_and_contacts(references)
    success = estimate_rate(check_references(references, trials=1, simulator=simulator).works, np.arange(len(depth)))
    depths = f"{1000 * np.median(depth):.1f}, {1000 * np.quantile(depth, 0.9):.1f}"
    return depths, f"{touching.mean():.1f}", format_estimate(success)


def fitted(references: ReferenceSet, grip: Grip) -> str:
    """Of how many hands synthesised references of a kind were chosen; nothing of others."""
    grips = json.loads(references.provenance or "{}").get("grips", {})
    return f", {grips[grip.name]['count']['sound']} sound of {grips[grip.name]['count']['fitted']}" if grips else ""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="what `synthesize-references` wrote to")
    parser.add_argument("objects", nargs="+", metavar="OBJECT")
    parser.add_argument("--most", type=int, default=24, help="references measured of each kind and source")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    start_warp()
    simulator = SimulatorConfig(threads=options.threads)
    rows = []
    for name in options.objects:
        made = read_references(options.folder / "references" / f"{name}.npz")
        sources = {"from the assets": load_references(name), "synthesised": made}
        for grip in GRIPS.values():
            found = {source: of_grip(each, grip, options.most) for source, each in sources.items()}
            if min(count for _, count in found.values()) < FEWEST:
                continue
            for source, (chosen, count) in found.items():
                there_are = f"{count}{fitted(chosen, grip)}"
                rows.append((name, grip.name, source, there_are, str(len(chosen)), *measure(chosen, simulator)))
    show(markdown_table(HEADER, rows))


if __name__ == "__main__":
    main()
