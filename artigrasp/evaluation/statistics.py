"""Values with 95 % intervals for trials that come in groups."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm, t

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

    Trials that share a reference are nearly the same experiment, so the interval counts the groups, not the trials:
    it is wide enough even if all trials of a group agree.

    Args:
        successes: Booleans, shape [trial].
        groups: Group of each trial, shape [trial].
    """
    successes = np.asarray(successes, dtype=float)
    count = len(np.unique(np.asarray(groups)))
    rate, z = float(successes.mean()), float(norm.ppf(0.5 + CONFIDENCE / 2))
    centre = (rate + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * np.sqrt(rate * (1 - rate) / count + z**2 / (4 * count**2))
    return Estimate(rate, max(0.0, float(centre - half)), min(1.0, float(centre + half)), len(successes))


def estimate_mean(values: ArrayLike, groups: ArrayLike) -> Estimate:
    """Mean with Student's interval over the means of the groups; one group alone has no interval.

    Args:
        values: Measured values, shape [trial].
        groups: Group of each trial, shape [trial].
    """
    values = np.asarray(values, dtype=float)
    labels = np.asarray(groups)
    means = np.array([values[labels == label].mean() for label in np.unique(labels)])
    value, count = float(values.mean()), len(means)
    if count < 2:
        return Estimate(value, None, None, len(values))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, count - 1) * means.std(ddof=1) / np.sqrt(count))
    return Estimate(value, value - half, value + half, len(values))
