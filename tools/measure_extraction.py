"""Measure how far extraction agrees with what ArtiGrasp's authors picked, and choose its numbers.

    python tools/measure_extraction.py PATH [--subjects s1 s5] [--objects box …] [--reconstructed] [--measured] \
        [--held-grasps] [--contacts] [--tune SUBJECT]

PATH is a copy of the ArtiGrasp release, whose objects and hands were imported. A label and an interaction of one
recording agree if they are at most 15 frames (0.5 s) apart, whichever hands do whichever thing; the pairing is the
largest there is. Recall is the share of labels with an interaction, precision that of interactions with a label: the
authors picked some interactions of each recording, so that precision is a lower bound. Both are given a second time
for pairs of the same task, and by chance, for as many frames drawn evenly from each recording. 95 % intervals in
brackets count recordings, not labels.

--contacts compares measured contacts with the release's, link by link, instead. --tune draws numbers for the rules,
keeps those that agree best with the labels of one subject (harmonic mean of recall and precision, same task), and tells
how well they do on the others.
"""

import argparse
import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from artigrasp.assets.arctic import ArcticSource, find_source
from artigrasp.cli.output import show, show_columns
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import ExtractionConfig
from artigrasp.evaluation.statistics import estimate_rate
from artigrasp.kernels.layout import LINKS
from artigrasp.references.agreement import REASONS, TOLERANCE, Pair, count_contacts, pair_labels
from artigrasp.references.arctic_labels import Label, read_labels
from artigrasp.references.arctic_references import TASKS
from artigrasp.references.extracted_references import PAPER_TASKS, choose_recordings, extract_all
from artigrasp.references.extraction import Extraction, Extractor
from artigrasp.references.interactions import Interaction, find_interactions
from tools.exits import exits_on_error

CHANCE_DRAWS = 200
NONE = "none"
GRID: dict[str, tuple[float, ...]] = {
    "base_speed": (0.05, 0.075, 0.1, 0.125, 0.15, 0.2),
    "hinge_rate": (0.3, 0.5, 0.8),
    "hinge_change": (0.1, 0.2, 0.3),
    "surface_height": (0.01, 0.02, 0.03, 0.04, 0.06),
    "holding_links": (2, 3, 4, 5),
    "turning_links": (1, 2, 3),
    "contact_time": (0.1, 0.17, 0.27),
    "pause": (0.33, 0.5, 0.67, 0.8),
    "duration": (0.2, 0.27, 0.33, 0.4, 0.5),
    "delay": (0.2, 0.3, 0.4, 0.5),
}
"""What --tune chooses from."""


@dataclass(frozen=True)
class Recorded:
    """What was found in a recording, and the labels of its object."""

    extraction: Extraction
    labels: Sequence[Label]

    def pair(self, config: ExtractionConfig) -> list[Pair]:
        """Labels and interactions of the paper's tasks."""
        return pair_labels(self.extraction, self.labels, PAPER_TASKS, config)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Measure the extraction of references.")
    parser.add_argument("path", type=Path)
    parser.add_argument("--subjects", nargs="*", default=["s1", "s5"])
    parser.add_argument("--objects", nargs="*", default=[], help="all that were imported by default")
    parser.add_argument("--reconstructed", action="store_true")
    parser.add_argument("--measured", action="store_true", help="measure contacts instead of using the release's")
    parser.add_argument("--held-grasps", action="store_true")
    parser.add_argument("--contacts", action="store_true")
    parser.add_argument("--tune", metavar="SUBJECT")
    parser.add_argument("--draws", type=int, default=600, help="of --tune")
    parser.add_argument("--seed", type=int, default=0, help="of --tune and of chance")
    options = parser.parse_args()
    start_warp()
    config = ExtractionConfig(held_grasps=options.held_grasps)
    with exits_on_error(parser):
        source = find_source(options.path)
        extractor = Extractor(source, config, measure=options.measured or options.contacts)
        recorded = {
            subject: extract(source, extractor, options.objects, subject, options.reconstructed)
            for subject in dict.fromkeys([*options.subjects, *([options.tune] if options.tune else [])])
        }
    if options.contacts:
        show_contacts(recorded)
    elif options.tune:
        tune(recorded, options.tune, config, options.draws, options.seed)
    else:
        for subject, of_subject in recorded.items():
            show_agreement(subject, [each.pair(config) for each in of_subject], of_subject, options.seed)


def extract(
    source: ArcticSource, extractor: Extractor, objects: list[str], subject: str, reconstructed: bool
) -> list[Recorded]:
    """What is found in all recordings of a subject."""
    chosen = choose_recordings(source, objects, [subject], reconstructed=reconstructed)
    with progress_bar(f"Extracting {subject}") as progress:
        return [
            Recorded(extraction, read_labels(source, name))
            for name, extractions in extract_all(extractor, chosen, progress)
            for extraction in extractions
        ]


def show_agreement(subject: str, pairs: list[list[Pair]], recorded: list[Recorded], seed: int) -> None:
    """Recall and precision, by object, the confusion of tasks and the reasons of what was missed."""
    every = [pair for of_recording in pairs for pair in of_recording]
    show(f"\n{subject}: {len(recorded)} recordings, within {TOLERANCE} frames")
    rows: list[tuple[str, ...]] = [
        ("  object", "labels", "found", "paired", "same task", "recall", "same task", "precision", "same task")
    ]
    for name in sorted({_object(pair) for pair in every}):
        rows.append((f"  {name}", *_row([pair for pair in every if _object(pair) == name], interval=False)))
    rows.append(("  all", *_row(every, interval=True)))
    chance = by_chance(recorded, every, seed)
    rows.append(("  all, by chance", "", "", "", "", *(f"{value:.2f}" for value in chance)))
    show_columns(rows)
    offsets = [pair.interaction.frame - pair.label.frame for pair in every if pair.label and pair.interaction]
    low, middle, high = np.percentile(offsets, (25, 50, 75))
    show(f"  frames from label to interaction: median {middle:+.0f}, quartiles {low:+.0f} and {high:+.0f}")
    counts = Counter((_task(pair.label), _task(pair.interaction)) for pair in every)
    tasks = [task for task in TASKS if any(task in key for key in counts)]
    show_columns(
        [
            ("  labelled \\ found", *tasks, NONE),
            *((f"  {row}", *(str(counts[row, column] or "") for column in (*tasks, NONE))) for row in (*tasks, NONE)),
        ]
    )
    reasons = Counter(pair.reason for pair in every if pair.reason)
    show("  missed: " + ", ".join(f"{reasons[reason]} {reason}" for reason in REASONS if reasons[reason]))


def by_chance(recorded: list[Recorded], every: list[Pair], seed: int) -> tuple[float, float, float, float]:
    """Recall and precision, each also of the same task, of frames drawn evenly, tasks as often as they are found."""
    draw = np.random.default_rng(seed)
    tasks = [pair.interaction.task for pair in every if pair.interaction]
    labels = paired = same = found = 0
    for _ in range(CHANCE_DRAWS):
        for each in recorded:
            length = len(each.extraction.states)
            wanted = [found for found in each.extraction.interactions if found.task in PAPER_TASKS]
            frames = draw.integers(length, size=len(wanted)).tolist()
            guesses = tuple(Interaction(str(draw.choice(tasks)), frame, frame, frame, 0) for frame in frames)
            pairs = Recorded(replace(each.extraction, interactions=guesses), each.labels).pair(ExtractionConfig())
            labels += sum(pair.label is not None for pair in pairs)
            found += len(guesses)
            paired += sum(pair.label is not None and pair.interaction is not None for pair in pairs)
            same += sum(pair.same_task for pair in pairs)
    return paired / labels, same / labels, paired / found, same / found


def tune(recorded: dict[str, list[Recorded]], subject: str, config: ExtractionConfig, draws: int, seed: int) -> None:
    """Draw numbers, and show the best on one subject beside those that are the default."""
    draw = random.Random(seed)
    drawn: list[dict[str, Any]] = [{name: draw.choice(each) for name, each in GRID.items()} for _ in range(draws)]
    candidates = [replace(config, **each) for each in drawn]
    with progress_bar("Tuning") as progress:
        scores = []
        for index, each in enumerate(candidates):
            scores.append(score(recorded[subject], each))
            progress("", index + 1, draws)
    best = candidates[int(np.argmax(scores))]
    for what, chosen in (("default", config), (f"best of {draws} on {subject}", best)):
        figures = ", ".join(f"{score(of_subject, chosen):.3f} on {name}" for name, of_subject in recorded.items())
        show(f"{what}: {figures}")
    show(", ".join(f"{name} {value:g}" for name, value in asdict(best).items() if name in GRID))
    better = sum(each > score(recorded[subject], config) for each in scores)
    show(f"{better} of {draws} draws are better than the default on {subject}")


def score(recorded: list[Recorded], config: ExtractionConfig) -> float:
    """Harmonic mean of recall and precision of the same task."""
    pairs = []
    for each in recorded:
        found = tuple(find_interactions(each.extraction.signals, config))
        pairs += Recorded(replace(each.extraction, interactions=found), each.labels).pair(config)
    labels, found_count = (sum(getattr(pair, name) is not None for pair in pairs) for name in ("label", "interaction"))
    return 2 * sum(pair.same_task for pair in pairs) / (labels + found_count)


def show_contacts(recorded: dict[str, list[Recorded]]) -> None:
    """Precision, recall and their harmonic mean of measured contacts, for each link and for all."""
    head = (
        "  link",
        *(f"{subject} {figure}" for subject in recorded for figure in ("given", "precision", "recall", "F1")),
    )
    totals = {}
    for subject, of_subject in recorded.items():
        counts = [
            count_contacts(each.extraction.shown.contacts, each.extraction.contacts)
            for each in of_subject
            if each.extraction.shown.contacts is not None
        ]
        totals[subject] = sum(counts[1:], counts[0])
    for row, part in enumerate(("articulated part", "base", "either part")):
        show(f"\nContacts with the {part}:")
        rows = [head]
        for name, links in [*((name, [index]) for index, name in enumerate(LINKS)), ("all", list(range(len(LINKS))))]:
            cells = []
            for total in totals.values():
                both, given, measured = (each[row, links].sum() for each in (total.both, total.given, total.measured))
                figures = (both / measured, both / given, 2 * both / (measured + given))
                cells += [str(given), *(f"{figure:.3f}" for figure in figures)]
            rows.append((f"  {name}", *cells))
        show_columns(rows if part == "either part" else [head, rows[-1]])


def _row(pairs: list[Pair], *, interval: bool) -> tuple[str, ...]:
    labels, found = ([pair for pair in pairs if getattr(pair, name) is not None] for name in ("label", "interaction"))
    paired = [pair for pair in labels if pair.interaction is not None]
    rates = [
        _rate(agreed, [pair.recording.sequence for pair in of], interval)
        for of in (labels, found)
        for agreed in (
            [pair.label is not None and pair.interaction is not None for pair in of],
            [pair.same_task for pair in of],
        )
    ]
    return str(len(labels)), str(len(found)), str(len(paired)), str(sum(pair.same_task for pair in paired)), *rates


def _rate(successes: list[bool], groups: list[str], interval: bool) -> str:
    if not successes:
        return "-"
    estimate = estimate_rate(successes, groups)
    if not interval:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} [{estimate.low:.2f}, {estimate.high:.2f}]"


def _object(pair: Pair) -> str:
    return pair.recording.sequence.split("_")[0]


def _task(each: Label | Interaction | None) -> str:
    return NONE if each is None else each.task


if __name__ == "__main__":
    main()
