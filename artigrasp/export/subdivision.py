"""Loop subdivision of closed triangle meshes as a matrix, which serves a mesh in every pose."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array


def subdivide(faces: NDArray[np.int32]) -> tuple[csr_array, NDArray[np.int32]]:
    """Divide every triangle of a closed mesh into four, and round the mesh off as Loop does.

    Args:
        faces: Vertex indices of a closed surface, shape ``[F, 3]``.

    Returns:
        The matrix that makes the new vertices of the old, shape ``[V', V]``, and the new faces, shape ``[4 F, 3]``: the
        old vertices come first, then one for each edge.
    """
    count = int(faces.max()) + 1
    start, end, opposite = (faces.astype(np.int64)[:, np.roll([0, 1, 2], -turn)].T.ravel() for turn in range(3))
    low, high = np.minimum(start, end), np.maximum(start, end)
    edges, edge = np.unique(low * count + high, return_inverse=True)
    middle = count + np.arange(len(edges))
    # An edge's middle takes 3/8 of each end and 1/8 of what is opposite on both sides.
    rows: list[NDArray[np.int64]] = [middle, middle, count + edge]
    columns: list[NDArray[np.int64]] = [edges // count, edges % count, opposite]
    shares = [np.full(len(edges), 0.375), np.full(len(edges), 0.375), np.full(len(edge), 0.125)]
    # A vertex keeps most of itself and takes the rest from its neighbours.
    valence = np.bincount(start, minlength=count)
    taken = (40 - (3 + 2 * np.cos(2 * np.pi / valence)) ** 2) / (64 * valence)
    old = np.arange(count)
    rows += [old, start]
    columns += [old, end]
    shares += [1 - valence * taken, taken[start]]
    indices = (np.concatenate(rows), np.concatenate(columns))
    matrix = coo_array((np.concatenate(shares), indices), shape=(count + len(edges), count)).tocsr()
    first, second, third = (count + part for part in edge.reshape(3, -1))
    a, b, c = faces.T
    fine = [(a, first, third), (first, b, second), (third, second, c), (first, second, third)]
    return csr_array(matrix), np.concatenate([np.stack(corners, axis=1) for corners in fine]).astype(np.int32)
