"""Intervals against SciPy's own and against values from textbooks."""

import numpy as np
import pytest
from scipy import stats

from artigrasp.evaluation.statistics import estimate_mean, estimate_rate


@pytest.mark.parametrize(("successes", "count"), [(0, 10), (3, 10), (10, 10), (1, 1), (37, 65)])
def test_rate_of_independent_trials_is_wilsons(successes: int, count: int) -> None:
    """With one trial per group it is SciPy's score interval."""
    outcomes = np.arange(count) < successes
    found = estimate_rate(outcomes, np.arange(count))
    expected = stats.binomtest(successes, count).proportion_ci(0.95, method="wilson")
    assert (found.value, found.trials) == (successes / count, count)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_a_known_wilson_interval() -> None:
    """Eight of ten: 0.490 to 0.943 (Brown, Cai and DasGupta's formula by hand)."""
    found = estimate_rate([1] * 8 + [0] * 2, range(10))
    assert (found.low, found.high) == pytest.approx((0.4902, 0.9433), abs=1e-4)


def test_trials_of_one_reference_count_once() -> None:
    """Five goals per reference make the rate no more certain than one goal would."""
    groups = np.repeat(np.arange(13), 5)
    outcomes = groups < 9
    found, independent = estimate_rate(outcomes, groups), estimate_rate(np.arange(13) < 9, np.arange(13))
    assert (found.value, found.low, found.high) == (independent.value, independent.low, independent.high)
    assert (found.trials, independent.trials) == (65, 13)


def test_mean_of_groups_is_students() -> None:
    """The interval is that of a t-test on the groups' means."""
    rng = np.random.default_rng(0)
    groups = np.repeat(np.arange(8), 4)
    values = rng.normal(size=8)[groups] + 0.1 * rng.normal(size=32)
    found = estimate_mean(values, rng.permutation(8)[groups])
    means = values.reshape(8, 4).mean(axis=1)
    expected = stats.ttest_1samp(means, 0.0).confidence_interval(0.95)
    assert found.value == pytest.approx(values.mean()) and found.trials == 32
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))


def test_a_known_t_interval() -> None:
    """Two values 1 apart: half width t(0.975, 1) / 2 = 6.353."""
    found = estimate_mean([0.0, 1.0], ["a", "b"])
    assert (found.value, found.low, found.high) == pytest.approx((0.5, 0.5 - 6.3531, 0.5 + 6.3531), abs=1e-4)


def test_one_group_tells_nothing_of_the_spread() -> None:
    """A mean over a single reference has no interval, rather than one of no width."""
    found = estimate_mean([0.1, 0.3], ["only", "only"])
    assert (found.value, found.low, found.high, found.trials) == (0.2, None, None, 2)


def crossed(rows: int, columns: int) -> np.ndarray:
    """Groups of every pair of a row and a column, [trial, 2]."""
    return np.stack(np.meshgrid(range(rows), range(columns), indexing="ij"), axis=-1).reshape(-1, 2)


def test_pairs_count_the_fewer_of_their_references() -> None:
    """Success that depends on one of four grasps is known no better for nine articulations of each."""
    groups = crossed(4, 9)
    found, single = estimate_rate(groups[:, 0] < 3, groups), estimate_rate(np.arange(4) < 3, range(4))
    assert (found.value, found.low, found.high) == pytest.approx((single.value, single.low, single.high))
    assert found.trials == 36


def test_unequal_groups_count_as_fewer() -> None:
    """Nine trials of one reference and one of another are hardly two experiments."""
    groups = np.repeat([0, 1], [9, 1])
    found = estimate_rate(np.ones(10), groups)
    even = estimate_rate(np.ones(10), np.repeat([0, 1], 5))
    assert found.low < even.low


def test_both_references_of_pairs_spread_a_mean() -> None:
    """If one kind of reference explains all, the interval is that kind's; if both do, it is wider than either's."""
    rng = np.random.default_rng(0)
    groups = crossed(8, 12)
    rows, columns = rng.normal(size=8)[groups[:, 0]], rng.normal(size=12)[groups[:, 1]]
    one, alone = estimate_mean(rows, groups), estimate_mean(rows, groups[:, 0])
    assert (one.low, one.high) == pytest.approx((alone.low, alone.high))
    both = estimate_mean(rows + columns, groups)
    widths = [estimate_mean(rows + columns, groups[:, kind]) for kind in (0, 1)]
    assert both.high - both.low > max(each.high - each.low for each in widths)


def test_intervals_of_crossed_trials_cover_what_they_promise() -> None:
    """About 95 % hold the truth, where half of that would if pairs were taken for independent."""
    rng = np.random.default_rng(2)
    groups = crossed(10, 14)
    held = naive = 0
    for _ in range(300):
        values = rng.normal(size=10)[groups[:, 0]] + rng.normal(size=14)[groups[:, 1]] + rng.normal(size=140)
        pairs, independent = estimate_mean(values, groups), estimate_mean(values, np.arange(140))
        held += pairs.low < 0.0 < pairs.high
        naive += independent.low < 0.0 < independent.high
    assert held / 300 > 0.9 and naive / 300 < 0.7


def test_intervals_cover_what_they_promise() -> None:
    """Of many experiments with correlated trials, about 95 % of the intervals hold the truth."""
    rng = np.random.default_rng(1)
    groups = np.repeat(np.arange(12), 5)
    means, rates = 0, 0
    for _ in range(300):
        chance = rng.beta(2.0, 2.0, 12)[groups]
        values = rng.normal(size=12)[groups] + rng.normal(size=60)
        mean, rate = estimate_mean(values, groups), estimate_rate(rng.random(60) < chance, groups)
        assert mean.low is not None and mean.high is not None and rate.low is not None and rate.high is not None
        means += mean.low < 0.0 < mean.high
        rates += rate.low < 0.5 < rate.high
    assert 0.91 < means / 300 < 0.99
    assert rates / 300 > 0.95, "counting groups errs on the wide side"
