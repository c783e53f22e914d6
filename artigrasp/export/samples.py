"""Which samples of a motion tell most of it."""

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.export.bodies import box_corners, hand_bodies, load_models, object_bodies
from artigrasp.motion.file import Motion

CANDIDATES = 300
"""Samples to choose from, at most: evenly spaced ones of a longer motion."""
SMALL_CHANGE = 0.05
"""Where nothing moves farther than this in the whole motion, time counts for more than change [m]."""


def telling_samples(motion: Motion, count: int) -> NDArray[np.int64]:
    """Samples in their order, the first and the last among them, of which no two neighbours look alike.

    Two samples differ by their distance in time and by how far the hands or the object have moved in between, whichever
    have moved more, each as a share of the most that there is. The least difference of neighbours is made as large as
    it can be.

    Args:
        motion: The motion.
        count: Number of samples; all of a motion that has fewer.

    Raises:
        UserError: the motion's hand or object is not among the assets.
    """
    last = len(motion.time) - 1
    candidates = np.unique(np.linspace(0, last, min(last + 1, CANDIDATES)).round().astype(np.int64))
    if count >= len(candidates):
        return candidates
    if count == 1:
        return candidates[-1:]
    hands, object = load_models(motion)
    links = box_corners([body for hand in hand_bodies(motion, hands) for body in hand], candidates)
    moved = [_distances(points) for points in (links, box_corners(object_bodies(motion, object), candidates))]
    change = np.maximum(*moved)
    gone = np.abs(motion.time[candidates, None] - motion.time[candidates])
    return candidates[most_different(gone / gone.max() + change / max(change.max(), SMALL_CHANGE), count)]


def most_different(difference: Array, count: int) -> NDArray[np.int64]:
    """A rising sequence of items from the first to the last whose neighbours differ as much as they can.

    Args:
        difference: Of every two items, shape ``[N, N]``.
        count: Length of the sequence, 2 to N.
    """
    # least[j]: the least difference within the best sequence so far that ends in j.
    least = np.where(np.arange(len(difference)) == 0, np.inf, -np.inf)
    onward = np.where(np.triu(np.ones(difference.shape, bool), 1), difference, -np.inf)
    before = []
    for _ in range(count - 1):
        reached = np.minimum(least[:, None], onward)
        before.append(reached.argmax(axis=0))
        least = reached.max(axis=0)
    chosen = [len(difference) - 1]
    for each in reversed(before):
        chosen.append(int(each[chosen[-1]]))
    return np.array(chosen[::-1], np.int64)


def _distances(points: Array) -> Array:
    """Mean distance between where N points are in every two of T samples [m], shape ``[T, T]``."""
    total: Array = np.zeros((len(points), len(points)))
    for point in np.moveaxis(points, 1, 0):
        total += np.linalg.norm(point[:, None] - point, axis=-1)
    total /= points.shape[1]
    return total
