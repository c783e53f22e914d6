"""Search: tries offsets around what a controller does, in parallel worlds, and plays the best of them."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from artigrasp.config import SynergyConfig, TaskConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.cross_entropy import CrossEntropy, CrossEntropySettings
from artigrasp.controllers.rollout import OnPlan, run_episode
from artigrasp.environment.environment import Environment
from artigrasp.environment.tables import action_count, synergy_directions


@dataclass(frozen=True)
class Objective:
    """What a search seeks, in terms of what :meth:`Environment.episode_summary` measures."""

    within: Mapping[str, tuple[float, float]]
    """Ranges in which all of these must lie at the end for success, which counts one."""
    weights: Mapping[str, float]
    """What else counts."""
    error: str
    """What is reported of every candidate besides success."""

    def success(self, summary: Mapping[str, NDArray[np.float64]]) -> NDArray[np.bool_]:
        """Which worlds succeed; none whose physics failed."""
        passed = [(low < summary[name]) & (summary[name] < high) for name, (low, high) in self.within.items()]
        return np.asarray(np.all(passed, axis=0) & (summary["failed"] == 0))

    def score(self, summary: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """How good the outcome of every world is; higher is better."""
        counted = np.sum([weight * summary[name] for name, weight in self.weights.items()], axis=0)
        return np.asarray(self.success(summary) + counted - FAILURE_COST * summary["failed"])


FAILURE_COST = 10.0
"""What a world whose physics failed loses."""

OPEN = Objective(
    within={"success": (0.5, np.inf)},
    weights={"angle_error": -1.0, "mean_angle_error": -0.3, "max_displacement": -3.0, "max_tilt": -0.5},
    error="angle_error",
)
"""To open the hinge to its target while the base stays where it is; a fixed base does so anyway."""


@dataclass(frozen=True)
class FoundOffsets:
    """What a search found in every trial."""

    offsets: NDArray[np.float32]
    """The best candidate: offsets of each hand in units of their scales along the task's directions, in the order of
    ``SYNERGIES``, [trial, hand, direction]."""
    success: NDArray[np.bool_]
    """Whether the best of the first candidates succeeds, [trial, rollout]; the first is the controller itself."""
    error: NDArray[np.float64]
    """Its error by the objective, [trial, rollout]."""


class OffsetController:
    """A controller with constant offsets along the synergies, those of each world its own."""

    def __init__(self, base: Controller, offsets: NDArray[np.float32]) -> None:
        """Add offsets, [world, hand, direction] in units of their scales, to what ``base`` decides."""
        self.name, self.hand, self.rollout_count = base.name, base.hand, 0
        self.task = with_offsets(base.task)
        self._base, self._offsets = base, offsets

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action of the controller with the offsets added."""
        action = np.zeros((*features.shape[:2], action_count(self.task.action)), dtype=np.float32)
        decided = self._base.act(features)
        # the synergies' columns come first, and the controller may know nothing of them
        action[..., action.shape[-1] - decided.shape[-1] :] = decided
        action[..., : self._offsets.shape[-1]] += self._offsets
        return action


class SearchController:
    """The cross-entropy method over slow offsets of each hand, held for an episode, around a controller.

    The candidates of a trial are worlds of one batch; the first is the controller itself. They are judged in the same
    simulator and from the same start as the trial, which then plays the best of them afresh. So this is no policy: it
    needs the simulator, and is reported apart, with its number of rollouts.

    Attributes:
        found: What the last :meth:`plan` found, None before.
    """

    def __init__(
        self,
        base: Controller,
        settings: CrossEntropySettings | None = None,
        *,
        objective: Objective = OPEN,
        seed: int = 0,
    ) -> None:
        """Prepare a search.

        Args:
            base: What acts; the offsets are added to its own, if it has any.
            settings: How candidates are drawn.
            objective: What is sought.
            seed: Of the candidates.
        """
        self.name = "search" if base.name == "pd-ik" else f"{base.name}+search"
        self.task, self.hand = with_offsets(base.task), base.hand
        self.settings, self.objective, self.seed = settings or CrossEntropySettings(), objective, seed
        self.found: FoundOffsets | None = None
        self._base = base

    def seeking(self, objective: Objective) -> "SearchController":
        """The same search with another objective."""
        return SearchController(self._base, self.settings, objective=objective, seed=self.seed)

    @property
    def rollout_count(self) -> int:
        """Episodes tried before the one that counts."""
        return self.settings.rollouts

    @property
    def parallel_count(self) -> int:
        """Worlds that a trial is tried in at a time."""
        return min(self.settings.population, self.settings.rollouts)

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action of the controller with the offsets that :meth:`plan` found for each world."""
        if self.found is None:
            raise RuntimeError("a search must plan before it acts")
        return OffsetController(self._base, self.found.offsets).act(features)

    def plan(self, environment: Environment, on_plan: OnPlan = lambda done, total: None) -> None:
        """Search every world of an environment, from where its next episode starts.

        Args:
            environment: Made for this controller's task, without noise: only then do all episodes start alike.
            on_plan: Called with the control steps done and those of the whole search.
        """
        hands, steps = environment.hand_count, environment.episode_steps
        directions = len(synergy_directions(self.task.action.synergy))
        seeds = [(self.seed, zlib.crc32(name.encode())) for name in _reference_names(environment)]
        search = CrossEntropy(seeds, hands * directions, self.settings)
        total = self.settings.rollouts * steps
        successes: list[NDArray[np.bool_]] = []
        errors: list[NDArray[np.float64]] = []
        worlds = environment.repeat(self.parallel_count)
        while search.rollouts_left:
            candidates = search.propose()
            count, before = candidates.shape[1], search.candidates.shape[1]
            if worlds.world_count != environment.world_count * count:
                worlds = environment.repeat(count)
            offsets = candidates.reshape(-1, hands, directions).astype(np.float32)

            def report(step: int, before: int = before, count: int = count) -> None:
                on_plan(before * steps + count * step, total)

            run_episode(worlds, OffsetController(self._base, offsets), report)
            summary = {name: each.reshape(-1, count) for name, each in worlds.episode_summary().items()}
            search.learn(candidates, self.objective.score(summary))
            successes.append(self.objective.success(summary))
            errors.append(summary[self.objective.error])

        best = np.stack([search.best(count + 1) for count in range(self.settings.rollouts)], axis=1)
        chosen = search.candidates[np.arange(len(best)), best[:, -1]]
        self.found = FoundOffsets(
            chosen.reshape(-1, hands, directions).astype(np.float32),
            np.take_along_axis(np.concatenate(successes, axis=1), best, axis=1),
            np.take_along_axis(np.concatenate(errors, axis=1), best, axis=1),
        )


def with_offsets(task: TaskConfig) -> TaskConfig:
    """The task with slow offsets in its action, held for an episode, if it has none of its own."""
    if task.action.synergy is not None:
        return task
    synergy = SynergyConfig(squeeze=0.15, press=0.02, decision_interval=task.episode_steps)
    return replace(task, action=replace(task.action, synergy=synergy))


def _reference_names(environment: Environment) -> list[str]:
    """What names every world's reference, whichever others stand beside it."""
    names = [f"{each.object} {source}" for each in environment.references for source in each.source]
    return [names[index] for index in environment.worlds.first_reference]
