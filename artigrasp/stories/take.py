"""One try at a step of a story: what was recorded of it, and how it ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.environment.environment import Environment
from artigrasp.environment.instant import Instant
from artigrasp.environment.snapshot import read_instant
from artigrasp.kernels.phases import FIRST_FAILURE, OUTCOMES
from artigrasp.stories.plan import Situation

FIELDS = ("joint_q", "hand_base", "slot_pose", "slot_angle", "contact_force")


@dataclass(frozen=True, eq=False)
class Take:
    """One try at a step; T samples, the first of which is where it began."""

    samples: Mapping[str, NDArray[np.float32]]
    """What was recorded, [T, ...], by the names of ``FIELDS``; objects are in the story's order."""
    phases: tuple[str, ...]
    """Name of the phase at each sample."""
    slot: int
    """The object that it was about."""
    reference: str
    """Where the reference came from."""
    controller: str
    """What acted."""
    outcomes: tuple[tuple[str, str], ...]
    """What became of each phase."""
    summary: Mapping[str, float]
    """What was measured."""
    success: bool
    """Whether the step is done."""
    score: float
    """How well; higher is better."""
    after: Situation
    """Where it has led to."""

    @property
    def failure(self) -> str:
        """The first phase that failed and how, or nothing."""
        failed = [f"{phase} {outcome}" for phase, outcome in self.outcomes if outcome in OUTCOMES[FIRST_FAILURE:]]
        return failed[0] if failed else ""


@dataclass(frozen=True, eq=False)
class Ended:
    """What was recorded of a world that has gone through its phases; see :class:`Take`."""

    samples: Mapping[str, NDArray[np.float32]]
    phases: tuple[str, ...]
    outcomes: tuple[tuple[str, str], ...]
    summary: Mapping[str, float]
    instant: Instant


class TakeRecorder:
    """Records all worlds of an environment until each has gone through its phases."""

    def __init__(self, environment: Environment, order: Sequence[int]) -> None:
        """Prepare.

        Args:
            environment: The worlds, whose objects are ...
            order: ... those of the story with these indices.
        """
        self._environment, self._slots = environment, np.argsort(order).tolist()
        self._samples: list[list[list[NDArray[np.float32]]]] = [[] for _ in range(environment.world_count)]
        self._phases: list[list[str]] = [[] for _ in range(environment.world_count)]
        self._ended: dict[int, Ended] = {}

    def record(self, step: int) -> None:
        """Take the present states as samples, of worlds that are not through."""
        environment = self._environment
        hands, slots, phase = environment.state.hands, environment.state.slots, environment.phase.index.numpy()
        states = (hands.joint_q, hands.hand_base, slots.pose, slots.hinge_q, hands.contact_force)
        arrays = [each.numpy() for each in states]
        running = [world for world in range(environment.world_count) if world not in self._ended]
        for world in running:
            # copies: on the CPU the rows would go on changing with the environment's
            self._samples[world].append([np.array(each[world]) for each in arrays])
            self._phases[world].append(environment.phases[phase[world]].name)
        finished = environment.phase.finished.numpy()
        self._end([world for world in running if finished[world]])

    def end(self) -> list[Ended]:
        """What was recorded of every world; those that are not through end as they are."""
        worlds = range(self._environment.world_count)
        self._end([world for world in worlds if world not in self._ended])
        return [self._ended[world] for world in worlds]

    def _end(self, worlds: Sequence[int]) -> None:
        if not worlds:
            return
        environment = self._environment
        summary, outcomes = environment.episode_summary(), environment.phase_outcome.numpy()
        names = [phase.name for phase in environment.phases]
        for world in worlds:
            samples = {
                name: np.stack(rows) for name, rows in zip(FIELDS, zip(*self._samples[world], strict=True), strict=True)
            }
            samples |= {name: samples[name][:, self._slots] for name in ("slot_pose", "slot_angle")}
            self._ended[world] = Ended(
                samples=samples,
                phases=tuple(self._phases[world]),
                outcomes=tuple((name, OUTCOMES[code]) for name, code in zip(names, outcomes[world], strict=True)),
                summary={name: float(values[world]) for name, values in summary.items()},
                instant=read_instant(environment, world).in_order(self._slots),
            )
