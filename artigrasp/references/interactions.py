"""The paper's rules for which frames of a recording become references (supplement, Hand Pose Reference Generation).

Frames in which no hand touches the object are left out. While hands hold the object and its base moves off the surface
that it lies on, they grasp; while hands touch the articulated part and the hinge angle changes, they articulate. The
hand pose hardly changes during one interaction, so that one frame stands for it.

The paper leaves open what one interaction is. Here it lasts as long as the same hands touch and nothing pauses for
long, and the frame that stands for it comes a fixed time after it begins, as in the labels that the authors published.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config.extraction import ExtractionConfig
from artigrasp.kernels.layout import HANDS

Mask = NDArray[np.bool_]

FRAME_RATE = 30.0
"""Frames per second of ARCTIC's recordings."""
HANDS_OF = {1: "left", 2: "right", 3: "two"}
"""How a label names hands, by the sum of 1 for the left and 2 for the right."""


@dataclass(frozen=True, eq=False)
class Signals:
    """What a recording of T frames tells about its interactions.

    Attributes:
        base_speed: Root mean square speed over the surface of the base [m/s], shape (T,).
        hinge_angle: [rad], shape (T,).
        hinge_rate: [rad/s], shape (T,).
        height: Of the object's lowest point above the surface that it lies on [m], shape (T,).
        turning_links: Links of each hand that touch the articulated part, int, shape (T, 2).
        holding_links: Links of each hand that touch either part, int, shape (T, 2).
    """

    base_speed: Array
    hinge_angle: Array
    hinge_rate: Array
    height: Array
    turning_links: NDArray[np.int64]
    holding_links: NDArray[np.int64]


@dataclass(frozen=True)
class Interaction:
    """Frames in which hands do one thing.

    Attributes:
        task: What they do, a name of :data:`artigrasp.references.arctic_references.TASKS`.
        first: First frame of the movement.
        last: Last frame of the movement.
        frame: Frame that shows the hands.
        initial_frame: Frame before, in which the object lies still on its surface.
    """

    task: str
    first: int
    last: int
    frame: int
    initial_frame: int


def find_interactions(signals: Signals, config: ExtractionConfig) -> list[Interaction]:
    """The interactions of a recording, by their frame."""
    found: list[Interaction] = []
    moving = signals.base_speed > config.base_speed
    changing = np.abs(signals.hinge_rate) > config.hinge_rate
    on_surface = signals.height <= config.surface_height
    resting = np.flatnonzero(on_surface & ~moving)

    def add(task: str, first: int, last: int, frame: int) -> None:
        before = resting[resting <= first]
        found.append(Interaction(task, first, last, frame, int(before[-1]) if len(before) else 0))

    holding = _steady(signals.holding_links >= config.holding_links, config)
    turning = _steady(signals.turning_links >= config.turning_links, config)
    free = holding.copy()
    for hands, first, last in _movements(turning, changing, config):
        if np.ptp(signals.hinge_angle[first : last + 1]) < config.hinge_change:
            continue
        frame = _frame(first, last, config)
        add(f"{HANDS_OF[hands]}_arti", first, last, frame)
        free[first : last + 1, _members(hands)] = False
        for other in range(len(HANDS)):
            if config.held_grasps and other not in _members(hands) and holding[frame, other] and not on_surface[frame]:
                add(f"{HANDS[other]}_grasp", first, last, frame)
    for hands, first, last in _movements(free, moving, config):
        if on_surface[first]:
            add(f"{HANDS_OF[hands]}_grasp", first, last, _frame(first, last, config))
    return sorted(found, key=lambda each: (each.frame, each.task))


def _movements(touching: Mask, moving: Mask, config: ExtractionConfig) -> Iterator[tuple[int, int, int]]:
    """Hands, first and last frame of every movement in which the same hands touch, pauses bridged."""
    hands = touching @ (1 << np.arange(len(HANDS)))
    for first, end in _runs(hands):
        frames = first + np.flatnonzero(moving[first:end])
        pauses = np.flatnonzero(np.diff(frames) > _frames(config.pause)) + 1
        for part in np.split(frames, pauses):
            if hands[first] and len(part) >= max(_frames(config.duration), 1):
                yield int(hands[first]), int(part[0]), int(part[-1])


def _steady(touching: Mask, config: ExtractionConfig) -> Mask:
    """Contacts of each hand with interruptions bridged and short ones left out, shape (T, 2)."""
    shortest = _frames(config.contact_time)
    result = touching.copy()
    for hand in range(len(HANDS)):
        column = result[:, hand]
        inner = [(first, end) for first, end in _runs(column) if first > 0 and end < len(column)]
        for first, end in inner:
            if not column[first] and end - first <= shortest:
                column[first:end] = True
        for first, end in _runs(column):
            if column[first] and end - first < shortest:
                column[first:end] = False
    return result


def _runs(values: NDArray[np.generic]) -> list[tuple[int, int]]:
    """First frame and end of every run of equal values."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return list(zip([0, *changes.tolist()], [*changes.tolist(), len(values)], strict=True))


def _members(hands: int) -> list[int]:
    return [hand for hand in range(len(HANDS)) if hands >> hand & 1]


def _frame(first: int, last: int, config: ExtractionConfig) -> int:
    return min(first + _frames(config.delay), last)


def _frames(seconds: float) -> int:
    return round(seconds * FRAME_RATE)
