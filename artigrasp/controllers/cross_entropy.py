"""The cross-entropy method over many independent problems at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.config.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class CrossEntropySettings:
    """How candidates are drawn; the unit of a candidate's numbers is the problem's own."""

    rollouts: int = 64
    """Candidates of every problem in all."""
    population: int = 16
    """Candidates that are drawn at a time, before the distribution is fitted anew."""
    elites: int = 5
    """Best candidates so far that the distribution is fitted to."""
    initial_std: float = 0.8
    """Standard deviation of the first candidates."""
    least_std: float = 0.25
    """Standard deviation that fitting never goes below."""
    least_spread: float = 0.02
    """Difference between the scores of the best and the median candidate below which nothing is learned from them."""

    def __post_init__(self) -> None:
        require_positive(self, "rollouts", "population", "elites", "initial_std")
        require_not_negative(self, "least_std", "least_spread")


class CrossEntropy:
    """Searches several problems side by side: :meth:`propose` candidates, score them, :meth:`learn` from the scores.

    The very first candidate of every problem is zero. The distribution is an independent Gaussian per number, fitted to
    the best of all candidates so far: with few rollouts none of them may be forgotten. A problem draws from a generator
    of its own, so that its candidates do not depend on which other problems are searched beside it.

    Attributes:
        candidates: Every candidate so far, shape [problem, candidate, number].
        scores: Their scores, higher is better, shape [problem, candidate].
    """

    def __init__(self, seeds: Sequence[Sequence[int]], size: int, settings: CrossEntropySettings) -> None:
        """Begin a search.

        Args:
            seeds: What seeds each problem's generator.
            size: Numbers of one candidate.
            settings: How candidates are drawn.
        """
        self.settings = settings
        self._generators = [np.random.default_rng(each) for each in seeds]
        self.candidates: Array = np.zeros((len(seeds), 0, size))
        self.scores: Array = np.zeros((len(seeds), 0))
        self._mean = np.zeros((len(seeds), size))
        self._std = np.full((len(seeds), size), settings.initial_std)

    @property
    def rollouts_left(self) -> int:
        """Candidates that may still be proposed for every problem."""
        return self.settings.rollouts - int(self.candidates.shape[1])

    def propose(self) -> Array:
        """Draw the next candidates, shape [problem, candidate, number]: zero first and by itself, then populations."""
        if not self.candidates.shape[1]:
            return np.zeros((len(self._mean), 1, self._mean.shape[1]))
        count = min(self.settings.population, self.rollouts_left)
        noise = np.stack([each.standard_normal((count, self._mean.shape[1])) for each in self._generators])
        proposed: Array = self._mean[:, None] + self._std[:, None] * noise
        return proposed

    def learn(self, candidates: Array, scores: Array) -> None:
        """Take in the scores of proposed candidates, shape [problem, candidate], and fit the distribution anew.

        Problems that are given up have scores of minus infinity.
        """
        self.candidates = np.concatenate([self.candidates, candidates], axis=1)
        self.scores = np.concatenate([self.scores, scores], axis=1)
        order = np.argsort(-self.scores, axis=1, kind="stable")
        elites = np.take_along_axis(self.candidates, order[:, : self.settings.elites, None], axis=1)
        spread = self.scores.max(axis=1) - np.median(self.scores, axis=1)
        # where all candidates do alike their order means nothing, and the search stays as wide as it is
        learned = (spread >= self.settings.least_spread)[:, None]
        self._mean = np.where(learned, elites.mean(axis=1), self._mean)
        self._std = np.where(learned, np.maximum(elites.std(axis=1), self.settings.least_std), self._std)

    def best(self, rollouts: int | None = None) -> NDArray[np.int64]:
        """Index of each problem's best candidate, of the first so many or of all, shape [problem]."""
        return np.asarray(self.scores[:, :rollouts].argmax(axis=1))
