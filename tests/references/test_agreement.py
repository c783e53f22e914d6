"""Agreement of extraction with labels, on made-up ones."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from artigrasp.config import ExtractionConfig
from artigrasp.references.agreement import TOLERANCE, Pair, count_contacts, pair_labels
from artigrasp.references.arctic_labels import Label
from artigrasp.references.arctic_sequence import Recording
from artigrasp.references.extracted_references import PAPER_TASKS
from artigrasp.references.extraction import Extraction
from artigrasp.references.interactions import Interaction, Signals, find_interactions

RECORDING = Recording("s1", "box_use_01")
FRAME_COUNT = 300
CONFIG = ExtractionConfig()


def extraction(*found: tuple[str, int, int, int]) -> Extraction:
    """A recording in which hands touch all the time, and interactions: task, first, last and chosen frame."""
    zeros, touching = np.zeros(FRAME_COUNT), np.full((FRAME_COUNT, 2), 16)
    signals = Signals(zeros, zeros, zeros, zeros, touching, touching)
    interactions = tuple(Interaction(task, first, last, frame, 0) for task, first, last, frame in found)
    nothing: Any = None
    return Extraction(RECORDING, zeros, nothing, zeros.astype(bool), signals, interactions)


def label(task: str, frame: int, split: str = "train", recording: Recording = RECORDING) -> Label:
    """A label."""
    return Label(split, recording, task, 0, frame)


def pair(found: Extraction, *labels: Label) -> list[Pair]:
    """The pairs of the paper's tasks."""
    return pair_labels(found, labels, PAPER_TASKS, CONFIG)


def frames(pairs: list[Pair]) -> list[tuple[int | None, int | None]]:
    """Frames of labels and of interactions."""
    return [(each.label and each.label.frame, each.interaction and each.interaction.frame) for each in pairs]


def test_pairs_are_as_many_as_possible() -> None:
    """A label takes the second nearest interaction where that lets another label have the nearest."""
    found = extraction(("right_grasp", 90, 140, 100), ("right_grasp", 105, 140, 112))
    pairs = pair(found, label("right_grasp", 102), label("right_grasp", 86), label("right_grasp", 200))
    assert frames(pairs) == [(102, 112), (86, 100), (200, None)]
    assert [each.same_task for each in pairs] == [True, True, False]


def test_the_same_task_is_preferred() -> None:
    """Of two labels at one frame each gets the interaction of its task, though both are nearer to one."""
    found = extraction(("right_arti", 90, 140, 100), ("left_grasp", 90, 140, 110))
    pairs = pair(found, label("left_grasp", 100), label("right_arti", 100))
    assert frames(pairs) == [(100, 110), (100, 100)] and all(each.same_task for each in pairs)
    (other,) = pair(extraction(("right_grasp", 90, 140, 100)), label("two_grasp", 100))
    assert other.interaction is not None and not other.same_task


def test_the_tolerance_is_exact() -> None:
    """An interaction further away than it is another one."""
    found = extraction(("right_grasp", 90, 140, 100))
    assert len(pair(found, label("right_grasp", 100 + TOLERANCE))) == 1
    assert len(pair(found, label("right_grasp", 101 + TOLERANCE))) == 2


def test_labels_of_others_do_not_count() -> None:
    """Neither those of other recordings nor those of reconstructions, and only wanted tasks are found."""
    found = extraction(("right_grasp", 90, 140, 100), ("two_arti", 200, 240, 212))
    others = (label("right_grasp", 100, recording=Recording("s2", "box_use_01")), label("right_grasp", 100, "recon"))
    assert frames(pair(found, *others)) == [(None, 100)]


def held(**changes: object) -> Extraction:
    """A recording in which the right hand grasps from frame 60 to 140, or does nearly so."""
    moving = np.zeros(FRAME_COUNT)
    moving[60:140] = 0.5
    links = np.zeros((FRAME_COUNT, 2), int)
    links[50:150, 1] = 10
    signals = Signals(moving, np.zeros(FRAME_COUNT), np.zeros(FRAME_COUNT), np.zeros(FRAME_COUNT), 0 * links, links)
    signals = replace(signals, **changes)  # type: ignore[arg-type]
    return replace(extraction(), signals=signals, interactions=tuple(find_interactions(signals, CONFIG)))


SHORT = np.where(np.arange(FRAME_COUNT) // 4 == 16, 0.5, 0.0)


@pytest.mark.parametrize(
    ("found", "task", "reason"),
    [
        (held(), "right_grasp", "other frame"),
        (held(), "two_grasp", "other hands"),
        (held(), "right_arti", "unexplained"),
        (held(height=np.full(FRAME_COUNT, 0.1)), "right_grasp", "gripped in the air"),
        (held(base_speed=SHORT), "right_grasp", "too short"),
        (held(holding_links=np.tile([0, 2], (FRAME_COUNT, 1))), "right_grasp", "few links"),
        (held(base_speed=np.full(FRAME_COUNT, 0.05)), "right_grasp", "too slow"),
    ],
)
def test_misses_have_a_reason(found: Extraction, task: str, reason: str) -> None:
    """The first rule without which there would be an interaction."""
    assert pair(found, label(task, 100 if reason != "too short" else 66))[0].reason == reason


def test_contacts_are_counted_by_link() -> None:
    """Frames and hands add up."""
    random = np.random.default_rng(0)
    given, measured = random.random((2, 50, 2, 3, 16)) < 0.4
    counts = count_contacts(given, measured) + count_contacts(given[:10], measured[:10])
    link = (given[:, :, 1, 3], measured[:, :, 1, 3])
    both = (link[0] & link[1]).sum() + (link[0] & link[1])[:10].sum()
    assert counts.both[1, 3] == both and counts.both.shape == (3, 16)
    assert counts.given[1, 3] == link[0].sum() + link[0][:10].sum()
    assert counts.measured[1, 3] == link[1].sum() + link[1][:10].sum()
