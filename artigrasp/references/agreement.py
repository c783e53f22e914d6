"""How far extraction agrees with the frames that ArtiGrasp's authors picked by hand."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from artigrasp.config.extraction import ExtractionConfig
from artigrasp.references.arctic_labels import IMAGES, Label
from artigrasp.references.arctic_references import TASKS
from artigrasp.references.arctic_sequence import Recording
from artigrasp.references.extraction import Extraction
from artigrasp.references.interactions import Interaction, find_interactions
from artigrasp.references.splits import PARTED

TOLERANCE = 15
"""Frames between a label and an interaction up to which they may be the same."""
OTHER_FRAME, OTHER_HANDS, UNEXPLAINED = "other frame", "other hands", "unexplained"
RELAXED: dict[str, dict[str, float]] = {
    "gripped in the air": {"surface_height": math.inf},
    "too short": {"duration": 0.0},
    "few links": {"holding_links": 1, "turning_links": 1},
    "too slow": {"base_speed": 0.02, "hinge_rate": 0.1},
}
"""Rules that may be why a label has no interaction: without them there is one."""
REASONS = (OTHER_FRAME, OTHER_HANDS, *RELAXED, UNEXPLAINED)
"""Why a label has no interaction, in the order in which they are tried: another frame stands for the interaction, other
hands do it, a rule forbids it."""


@dataclass(frozen=True)
class Pair:
    """A label and the interaction that it agrees with, or one of both that agrees with nothing.

    Attributes:
        recording: The recording.
        label: What the authors labelled, or None.
        interaction: What was found, or None.
        reason: Why nothing was found for the label, one of ``REASONS``; empty for all others.
    """

    recording: Recording
    label: Label | None
    interaction: Interaction | None
    reason: str = ""

    @property
    def same_task(self) -> bool:
        """Whether both say that the same hands do the same."""
        return self.label is not None and self.interaction is not None and self.label.task == self.interaction.task


def pair_labels(
    extraction: Extraction, labels: Iterable[Label], tasks: tuple[str, ...], config: ExtractionConfig
) -> list[Pair]:
    """Pair the labels of one recording with what was found in it, as many as possible, of the same task if possible.

    Args:
        extraction: What was found.
        labels: The labels of its object; those of other recordings are left out.
        tasks: What counts as found.
        config: The rules' numbers.
    """
    splits = (IMAGES,) if extraction.recording.reconstructed else PARTED
    of_recording = [each for each in labels if each.recording == extraction.recording and each.split in splits]
    found = [each for each in extraction.interactions if each.task in tasks]
    apart = np.array([[abs(label.frame - each.frame) for each in found] for label in of_recording])
    apart = apart.reshape(len(of_recording), len(found))
    other = np.array([[label.task != each.task for each in found] for label in of_recording], bool).reshape(apart.shape)
    far = 10 * TOLERANCE
    cost = np.where(apart <= TOLERANCE, apart + 2 * TOLERANCE * other, far)
    paired = {row: column for row, column in zip(*linear_sum_assignment(cost), strict=True) if cost[row, column] < far}
    pairs = [
        Pair(extraction.recording, label, found[paired[row]])
        if row in paired
        else Pair(extraction.recording, label, None, _reason(label, extraction, config))
        for row, label in enumerate(of_recording)
    ]
    surplus = sorted(set(range(len(found))) - set(paired.values()))
    return pairs + [Pair(extraction.recording, None, found[column]) for column in surplus]


def _reason(label: Label, extraction: Extraction, config: ExtractionConfig) -> str:
    def around(interactions: Iterable[Interaction]) -> list[str]:
        return [each.task for each in interactions if each.first - TOLERANCE <= label.frame <= each.last + TOLERANCE]

    tasks = around(extraction.interactions)
    if label.task in tasks:
        return OTHER_FRAME
    if any(TASKS[task][0] == TASKS[label.task][0] for task in tasks):
        return OTHER_HANDS
    for reason, change in RELAXED.items():
        relaxed: Any = change
        if label.task in around(find_interactions(extraction.signals, replace(config, **relaxed))):
            return reason
    return UNEXPLAINED


@dataclass(frozen=True, eq=False)
class ContactCounts:
    """How often contacts were given and measured, by row of a sequence's contacts and link.

    Attributes:
        both: Given and measured, shape (3, 16).
        given: Given, shape (3, 16).
        measured: Measured, shape (3, 16).
    """

    both: NDArray[np.int64]
    given: NDArray[np.int64]
    measured: NDArray[np.int64]

    def __add__(self, other: "ContactCounts") -> "ContactCounts":
        return ContactCounts(self.both + other.both, self.given + other.given, self.measured + other.measured)


def count_contacts(given: NDArray[np.bool_], measured: NDArray[np.bool_]) -> ContactCounts:
    """Compare contacts of T frames, both of shape (T, 2, 3, 16)."""
    both, of_given, of_measured = (
        np.asarray(each.sum(axis=(0, 1)), np.int64) for each in (given & measured, given, measured)
    )
    return ContactCounts(both, of_given, of_measured)
