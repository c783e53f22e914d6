"""Values with 95 % intervals for trials that come in groups."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import norm, t

from artigrasp.arrays import Array

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """A mean with its 95 % interval.

    Attributes:
        value: The mean over all trials.
        low: Lower end of the interval, None where there is too little to tell.
        high: Upper end, likewise.
        trials: Number of trials.
    """

    value: float
    low: float | None
    high: float | None
    trials: int


def estimate_rate(successes: ArrayLike, groups: ArrayLike) -> Estimate:
    """Success rate with Wilson's score interval.

    Trials that share a reference are nearly the same experiment, so the interval counts groups, not trials: it is wide
    enough even if all trials of a group agree. Where trials pair references of two kinds, it counts those of the kind
    that makes fewer groups, and is wide enough even if success depends on that kind alone. Groups of unequal size count
    as fewer (Kish's effective sample size).

    Args:
        successes: Booleans, shape [trial].
        groups: Group of each trial, shape [trial], or one of each kind that are crossed, [trial, kind].
    """
    successes = np.asarray(successes, dtype=float)
    count = min(len(kind) ** 2 / np.square(np.bincount(kind)).sum() for kind in _kinds(groups))
    rate, z = float(successes.mean()), float(norm.ppf(0.5 + CONFIDENCE / 2))
    centre = (rate + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * np.sqrt(rate * (1 - rate) / count + z**2 / (4 * count**2))
    return Estimate(rate, max(0.0, float(centre - half)), min(1.0, float(centre + half)), len(successes))


def estimate_mean(values: ArrayLike, groups: ArrayLike) -> Estimate:
    """Mean with Student's interval over groups; one group alone has no interval.

    With groups of one size it is that of the groups' means. Where groups are crossed, the variances that either kind
    explains add up, less that of the cells, which both hold (Cameron, Gelbach and Miller, 2011); it is no less than
    that of one kind alone.

    Args:
        values: Measured values, shape [trial].
        groups: Group of each trial, shape [trial], or one of each kind that are crossed, [trial, kind].
    """
    values = np.asarray(values, dtype=float)
    kinds = _kinds(groups)
    value, count = float(values.mean()), min(kind.max() + 1 for kind in kinds)
    if count < 2:
        return Estimate(value, None, None, len(values))
    variances = [_clustered_variance(values, kind) for kind in kinds]
    variance = max(variances)
    if len(kinds) > 1:
        cells = np.unique(np.stack(kinds), axis=1, return_inverse=True)[1].reshape(-1)
        variance = max(variance, sum(variances) - _clustered_variance(values, cells))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, count - 1) * np.sqrt(variance))
    return Estimate(value, value - half, value + half, len(values))


def _kinds(groups: ArrayLike) -> list[NDArray[np.int64]]:
    """Groups of every kind as whole numbers from zero on, each of shape [trial]."""
    labels = np.asarray(groups)
    labels = labels.reshape(len(labels), -1)
    return [np.unique(column, return_inverse=True)[1].reshape(-1) for column in labels.T]


def _clustered_variance(values: Array, groups: NDArray[np.int64]) -> float:
    """Variance of the mean if only the groups are independent of each other."""
    sums = np.bincount(groups, values - values.mean())
    return float(np.square(sums).sum() * len(sums) / (len(sums) - 1) / len(values) ** 2)
