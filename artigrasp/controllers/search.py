"""Search: tries offsets around what a controller does, in parallel worlds, and plays the best of them."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config import PhaseConfig, SynergyConfig, TaskConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.cross_entropy import CrossEntropy, CrossEntropySettings
from artigrasp.controllers.rollout import OnPlan, run_episode
from artigrasp.environment.action_columns import action_count, synergy_directions
from artigrasp.environment.environment import Environment

Ranges = Mapping[str, tuple[float, float]]
"""Between what some of the measurements of :meth:`Environment.episode_summary` lie."""


@dataclass(frozen=True)
class Objective:
    """What a search seeks, in terms of what :meth:`Environment.episode_summary` measures."""

    within: Ranges
    """Where all of these must lie at the end for success, which counts one."""
    weights: Mapping[str, float]
    """What else counts."""
    error: str
    """What is reported of every candidate besides success."""
    enough: Ranges = field(default_factory=dict)
    """Where these must lie besides for the search to be content and stop."""

    def success(self, summary: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Which worlds succeed; none whose physics failed."""
        return np.asarray(_all_within(self.within, summary) & (summary["failed"] == 0))

    def content(self, summary: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Which worlds succeed so well that nothing better need be sought."""
        return np.asarray(self.success(summary) & _all_within(self.enough, summary))

    def score(self, summary: Mapping[str, Array]) -> Array:
        """How good the outcome of every world is; higher is better."""
        counted = np.sum([weight * summary[name] for name, weight in self.weights.items()], axis=0)
        return np.asarray(self.success(summary) + counted - FAILURE_COST * summary["failed"])


FAILURE_COST = 10.0
"""What a world whose physics failed loses."""

OPEN = Objective(
    within={"success": (0.5, np.inf)},
    weights={"angle_error": -1.0, "mean_angle_error": -0.3, "max_displacement": -3.0, "max_tilt": -0.5},
    error="angle_error",
    enough={"angle_error": (-np.inf, 0.05), "max_displacement": (-np.inf, 0.03), "max_tilt": (-np.inf, 0.2)},
)
"""To open the hinge to its target while the base stays where it is; a fixed base does so anyway."""


@dataclass(frozen=True)
class FoundOffsets:
    """What a search found in every trial."""

    offsets: NDArray[np.float32]
    """The best candidate: offsets of each hand in units of their scales along the task's directions, in the order of
    ``SYNERGIES``, for each decision of an episode, [trial, decision, hand, direction]."""
    rollouts: NDArray[np.int64]
    """Rollouts until the search was content or had none left, [trial]."""
    success: NDArray[np.bool_]
    """Whether the best of the first rollouts succeeds, [trial, rollout]; the first is the controller itself. While an
    earlier decision is searched it is false, and after the last rollout it stays as it is."""
    error: Array
    """Its error by the objective, [trial, rollout]; while an earlier decision is searched, that of the first whole
    episode."""


class OffsetController:
    """A controller with offsets along the synergies, held in each of an episode's decisions."""

    def __init__(self, base: Controller, offsets: NDArray[np.float32], environment: Environment) -> None:
        """Add offsets to what ``base`` decides.

        Args:
            base: What acts.
            offsets: Those of every world, [world, decision, hand, direction] in units of their scales.
            environment: The worlds, whose phases tell which decision is due.
        """
        self.name, self.hand, self.rollout_count = base.name, base.hand, 0
        self.task = with_offsets(base.task)
        self._base, self._offsets, self._environment = base, offsets, environment
        last = offsets.shape[1] - 1
        self._decision = np.clip(np.cumsum([_decides(each) for each in environment.phases]) - 1, 0, last)

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action of the controller with the offsets added."""
        action = np.zeros((*features.shape[:2], action_count(self.task.action)), dtype=np.float32)
        decided = self._base.act(features)
        # the synergies' columns come first, and the controller may know nothing of them
        action[..., action.shape[-1] - decided.shape[-1] :] = decided
        decision = self._decision[self._environment.phase.index.numpy()]
        action[..., : self._offsets.shape[-1]] += self._offsets[np.arange(len(decision)), decision]
        return action


class SearchController:
    """The cross-entropy method over slow offsets of each hand, held for a decision, around a controller.

    The candidates of a trial are worlds of one batch; the first is the controller itself. They are judged in the same
    simulator and from the same start as the trial, which then plays the best of them afresh. So this is no policy: it
    needs the simulator, and is reported apart, with its number of rollouts. Of a trial with several decisions, such as
    grasping and articulating, each has an objective and its share of the rollouts: offsets of the first are tried in
    the phases before the second, whose offsets are then sought with the best of the first.

    Attributes:
        found: What the last :meth:`plan` found, None before.
    """

    def __init__(
        self,
        base: Controller,
        settings: CrossEntropySettings | None = None,
        *,
        objectives: Sequence[Objective] = (OPEN,),
        seed: int = 0,
    ) -> None:
        """Prepare a search.

        Args:
            base: What acts; the offsets are added to its own, if it has any.
            settings: How candidates are drawn.
            objectives: What is sought by each decision of an episode.
            seed: Of the candidates.
        """
        self.name = "search" if base.name == "pd-ik" else f"{base.name}+search"
        self.task, self.hand = with_offsets(base.task), base.hand
        self.settings, self.objectives, self.seed = settings or CrossEntropySettings(), tuple(objectives), seed
        self.found: FoundOffsets | None = None
        self._base = base
        self._playing: OffsetController | None = None

    def seeking(self, objectives: Sequence[Objective]) -> "SearchController":
        """The same search with other objectives."""
        return SearchController(self._base, self.settings, objectives=objectives, seed=self.seed)

    @property
    def rollout_count(self) -> int:
        """Episodes tried before the one that counts, at most."""
        return self.settings.rollouts

    @property
    def parallel_count(self) -> int:
        """Worlds that a trial is tried in at a time."""
        return min(self.settings.population, self.settings.rollouts)

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action of the controller with the offsets that :meth:`plan` found for each world."""
        if self._playing is None:
            raise RuntimeError("a search must plan before it acts")
        return self._playing.act(features)

    def plan(self, environment: Environment, on_plan: OnPlan = lambda done, total: None) -> None:
        """Search every world of an environment, from where its next episode starts.

        Args:
            environment: Made for this controller's task, without noise: only then do all episodes start alike.
            on_plan: Called with the control steps done and those of the whole search.
        """
        stages, rollouts = len(self.objectives), self.settings.rollouts
        directions = len(synergy_directions(self.task.action.synergy))
        shape = (environment.world_count, stages, environment.hand_count, directions)
        offsets, used = np.zeros(shape, dtype=np.float32), np.zeros(shape[0], dtype=np.int64)
        total = rollouts * environment.episode_steps
        for stage in range(stages):
            first = rollouts * stage // stages
            budget = rollouts * (stage + 1) // stages - first

            def report(done: float, first: int = first) -> None:
                on_plan(int((first + done) * environment.episode_steps), total)

            earlier = used
            success, error, tried = self._search_decision(environment, stage, budget, offsets, report)
            used = earlier + tried
        on_plan(total, total)
        # while earlier decisions are searched, there is nothing yet to say of the whole
        since = np.arange(rollouts) - earlier[:, None]
        column = np.clip(since, 0, success.shape[1] - 1)
        self.found = FoundOffsets(
            offsets,
            used,
            np.take_along_axis(success, column, axis=1) & (since >= 0),
            np.take_along_axis(error, column, axis=1),
        )
        self._playing = OffsetController(self._base, offsets, environment)

    def _search_decision(
        self,
        environment: Environment,
        stage: int,
        budget: int,
        offsets: NDArray[np.float32],
        on_rollout: Callable[[float], None],
    ) -> tuple[NDArray[np.bool_], Array, NDArray[np.int64]]:
        """Search the offsets of one decision, of which the best are written into ``offsets``.

        Args:
            environment: The worlds to search, each by itself.
            stage: Which decision.
            budget: Rollouts of every world, at most.
            offsets: Those of all decisions, in and out, [trial, decision, hand, direction].
            on_rollout: Called with the rollouts done, in fractions too.

        Returns:
            Success and error of the best of the first rollouts, [trial, rollout], and the number of rollouts, [trial].
        """
        objective, phases = self.objectives[stage], phases_until(environment.phases, stage + 1)
        seeds = [(self.seed, stage, zlib.crc32(name.encode())) for name in _reference_names(environment)]
        search = CrossEntropy(seeds, offsets[0, stage].size, replace(self.settings, rollouts=budget))
        shape = (len(seeds), budget)
        success, error, tried = np.zeros(shape, dtype=bool), np.zeros(shape), np.zeros(shape, dtype=bool)
        searching, searched, worlds = np.ones(len(seeds), dtype=bool), None, environment
        while search.rollouts_left and searching.any():
            candidates = search.propose()
            count, before = candidates.shape[1], search.candidates.shape[1]
            if searched is None or not np.array_equal(searched, count * searching):
                searched = count * searching
                worlds = environment.repeat(searched, phases)
            trial = np.repeat(offsets[searching], count, axis=0)
            trial[:, stage] = candidates[searching].reshape(len(trial), *trial.shape[2:])

            def report(step: int, before: int = before, count: int = count, steps: int = worlds.episode_steps) -> None:
                on_rollout(before + count * step / steps)

            run_episode(worlds, OffsetController(self._base, trial, worlds), report)
            summary = {name: each.reshape(-1, count) for name, each in worlds.episode_summary().items()}
            block = np.ix_(searching, np.arange(before, before + count))
            success[block], error[block], tried[block] = objective.success(summary), summary[objective.error], True
            scores = np.full(candidates.shape[:2], -np.inf)  # of those that are no longer sought
            scores[searching] = objective.score(summary)
            search.learn(candidates, scores)
            searching[searching] = ~objective.content(summary).any(axis=1)

        rollouts = search.candidates.shape[1]
        best = np.stack([search.best(count + 1) for count in range(rollouts)], axis=1)
        chosen = search.candidates[np.arange(len(best)), best[:, -1]]
        offsets[:, stage] = chosen.reshape(offsets[:, stage].shape)
        return (
            np.take_along_axis(success, best, axis=1),
            np.take_along_axis(error, best, axis=1),
            tried.sum(axis=1),
        )


def phases_until(phases: Sequence[PhaseConfig], decision_count: int) -> tuple[PhaseConfig, ...]:
    """The phases before the one that begins the next decision after so many."""
    decisions = np.cumsum([_decides(each) for each in phases])
    return tuple(each for each, decision in zip(phases, decisions, strict=True) if decision <= decision_count)


def _decides(phase: PhaseConfig) -> bool:
    return phase.decides and phase.action.synergy is not None


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


def _all_within(ranges: Ranges, summary: Mapping[str, Array]) -> NDArray[np.bool_]:
    inside = [(low < summary[name]) & (summary[name] < high) for name, (low, high) in ranges.items()]
    return np.asarray(np.all(inside, axis=0))
