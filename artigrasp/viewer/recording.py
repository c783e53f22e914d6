"""What the viewer shows of one world: samples in time, and what they aim at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.config import StageConfig
from artigrasp.kernels.layout import LINK_COUNT, PARTS


@dataclass(frozen=True, eq=False)
class Sample:
    """One instant of H hands and O objects, all poses in the world: position [m], quaternion xyzw.

    Attributes:
        time: Since the start [s].
        link_poses: Of the hand links, shape ``[H, 16, 7]``.
        part_poses: Of the objects' parts, shape ``[O, 2, 7]``.
        focus: The object that hands manipulate.
        hinge_angle: Of that object [rad].
        contact_force: On each hand link from each part of it, in the world [N], shape ``[H, 16, 2, 3]``.
        phase: What goes on.
        signals: Numbers worth a plot by name, such as the terms of the reward.
    """

    time: float
    link_poses: NDArray[np.float32]
    part_poses: NDArray[np.float32]
    focus: int
    hinge_angle: float
    contact_force: NDArray[np.float32]
    phase: str = ""
    signals: Mapping[str, float] = field(default_factory=dict)


class Recording:
    """Samples in the order of their times, which may still be growing; one thread appends while others read.

    Attributes:
        hands: Sides of the hands.
        count: Samples so far.
    """

    def __init__(self, capacity: int, hands: Sequence[str], object_count: int = 1) -> None:
        """Room for so many samples of these hands and so many objects."""
        self.hands, self.count = tuple(hands), 0
        hand_count = len(self.hands)
        self._time = np.zeros(capacity)
        self._hinge_angle = np.zeros(capacity)
        self._link_poses = np.zeros((capacity, hand_count, LINK_COUNT, 7), np.float32)
        self._part_poses = np.zeros((capacity, object_count, len(PARTS), 7), np.float32)
        self._focus = np.zeros(capacity, np.int64)
        self._contact_force = np.zeros((capacity, hand_count, LINK_COUNT, len(PARTS), 3), np.float32)
        self._phases: list[str] = []
        self._signals: dict[str, list[float]] = {}

    def append(self, sample: Sample) -> None:
        """Add the next sample."""
        row = self.count
        self._time[row], self._hinge_angle[row] = sample.time, sample.hinge_angle
        self._link_poses[row], self._part_poses[row] = sample.link_poses, sample.part_poses
        self._contact_force[row], self._focus[row] = sample.contact_force, sample.focus
        self._phases.append(sample.phase)
        for name, value in sample.signals.items():
            self._signals.setdefault(name, []).append(value)
        # last, so that a reader never sees half a sample
        self.count = row + 1

    @property
    def duration(self) -> float:
        """Time of the last sample so far, counted from the first [s]."""
        return float(self._time[self.count - 1] - self._time[0]) if self.count else 0.0

    def at(self, time: float) -> Sample:
        """The sample that is shown at a time since the first [s]: the last one that is not later."""
        if self.count == 0:
            raise ValueError("recording: expected at least one sample, found none")
        times = self._time[: self.count] - self._time[0]
        row = max(int(np.searchsorted(times, time + 1e-9, side="right")) - 1, 0)
        return Sample(
            float(times[row]),
            self._link_poses[row],
            self._part_poses[row],
            int(self._focus[row]),
            float(self._hinge_angle[row]),
            self._contact_force[row],
            self._phases[row],
            {name: values[row] for name, values in self._signals.items() if row < len(values)},
        )

    def curves(self) -> tuple[Array, dict[str, Array]]:
        """Times of all samples so far [s], shape ``[T]``, and what can be plotted over them, by name."""
        count = self.count
        force = np.linalg.norm(self._contact_force[:count].sum(axis=(2, 3)), axis=-1)
        curves = {"hinge angle": np.degrees(self._hinge_angle[:count])}
        curves |= {f"force {side}": force[:, hand].astype(np.float64) for hand, side in enumerate(self.hands)}
        # a signal may lag behind by the sample that is being appended
        curves |= {name: np.array(values[:count]) for name, values in self._signals.items() if len(values) >= count}
        return self._time[:count] - self._time[0], curves


@dataclass(frozen=True, eq=False)
class Aim:
    """What a recording should come to, for its first object.

    Attributes:
        angle: Hinge angle to reach [rad], None if there is none.
        object_pose: Pose of the object's base to reach in the world, shape ``[7]``, None if it should stay.
        part: Part that each hand manipulates, shape ``[H]``.
        link_poses_in_part: Reference poses of the hand links in that part's frame, shape ``[H, 16, 7]``.
        contacts: Links that should touch in the reference, shape ``[H, 16]``; None if that is not known.
        active: Hands that take part, shape ``[H]``.
        needs_ghost: Whether the hands may be elsewhere than in the reference, so that a ghost tells something.
    """

    angle: float | None
    object_pose: NDArray[np.float32] | None
    part: NDArray[np.int64]
    link_poses_in_part: NDArray[np.float32]
    contacts: NDArray[np.bool_] | None
    active: NDArray[np.bool_]
    needs_ghost: bool = True


@dataclass(frozen=True, eq=False)
class Track:
    """One of the things that are shown side by side.

    Attributes:
        label: What it is, in words.
        hands: Model of each hand.
        objects: Models of the objects, the one that references are of first.
        recording: What happens.
        aim: What should happen, None if that is not known.
        stage: A plateau on the table, if there is one.
        metrics: Measures of the whole, by name, as far as they are known.
    """

    label: str
    hands: Sequence[HandModel]
    objects: Sequence[ObjectModel]
    recording: Recording
    aim: Aim | None = None
    stage: StageConfig | None = None
    metrics: dict[str, float] = field(default_factory=dict)
