"""Tests of the samples that tell most of a motion."""

import dataclasses
import itertools

import numpy as np

from artigrasp.export.samples import most_different, telling_samples
from artigrasp.motion.file import Motion
from tests.motion.example import example_motion


def still_motion(sample_count: int, **changes: np.ndarray) -> Motion:
    """A motion in which nothing moves but what is given."""
    motion = example_motion(sample_count=sample_count)
    still = {
        "joint_q": np.zeros_like(motion.joint_q),
        "object_pose": np.tile(motion.object_pose[:1], (sample_count, 1)),
        "hinge_angle": np.zeros(sample_count),
    }
    return dataclasses.replace(motion, **(still | changes))


def test_most_different_is_the_best_of_all() -> None:
    """The least difference of neighbours is that of the best of all rising sequences, tried one by one."""
    random = np.random.default_rng(1)
    for _ in range(5):
        difference = random.random((9, 9))
        difference += difference.T
        found = most_different(difference, 4)
        assert found[0] == 0 and found[-1] == 8 and (np.diff(found) > 0).all()

        def least(sequence: tuple[int, ...], difference: np.ndarray = difference) -> float:
            return min(difference[a, b] for a, b in itertools.pairwise(sequence))

        every = [(0, a, b, 8) for a, b in itertools.combinations(range(1, 8), 2)]
        assert least(tuple(found)) == max(map(least, every))


def test_a_still_motion_is_sampled_evenly() -> None:
    """Where nothing moves, or only noise is there, time alone counts."""
    noise = 1e-4 * np.random.default_rng(0).normal(size=101)
    for angle in (np.zeros(101), noise):
        samples = telling_samples(still_motion(101, hinge_angle=angle), 5)
        np.testing.assert_allclose(samples, [0, 25, 50, 75, 100], atol=3)


def test_a_late_turn_gets_its_share() -> None:
    """A lid that turns within the last tenth of a motion is seen at several angles, but not only that."""
    angle = np.interp(np.arange(101), [0, 90, 100], [0.0, 0.0, 1.2])
    samples = telling_samples(still_motion(101, hinge_angle=angle), 6)
    assert (samples >= 90).sum() >= 3 and ((samples > 5) & (samples < 90)).sum() >= 1
    assert samples[0] == 0 and samples[-1] == 100


def test_short_motions_are_shown_whole() -> None:
    """There are never more samples than the motion has; a single one is the last."""
    assert telling_samples(example_motion(sample_count=3), 5).tolist() == [0, 1, 2]
    assert telling_samples(example_motion(sample_count=3), 1).tolist() == [2]
    assert telling_samples(example_motion(sample_count=1), 5).tolist() == [0]
