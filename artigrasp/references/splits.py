"""Which references train and which measure: the split that a file gives, and schemes that ask more of a policy.

In the paper's split, ``"train"`` and ``"test"``, most test references come from a recording that train references come
from too. Two schemes part the same references so that none is measured on what it was trained beside:

* ``"by-sequence/train"`` and ``"by-sequence/test"``: no recording is in both. A third of them, drawn by a hash of their
  names, are for the test, whichever of them a file has.
* ``"by-subject/train"`` and ``"by-subject/test"``: no subject is in both; subject s5 is for the test.

References whose recording is unknown, and reconstructed ones with their counterparts, belong to no scheme.
"""

import hashlib

import numpy as np
from numpy.typing import NDArray

PARTED = ("train", "test")
"""The given splits that the schemes part anew."""
HELD_OUT_SUBJECT = "s5"
SEQUENCES_PER_TEST = 3
"""One in so many recordings is for the test."""
SCHEME_SPLITS = tuple(f"{scheme}/{part}" for scheme in ("by-sequence", "by-subject") for part in PARTED)


def in_split(
    split: str, given: NDArray[np.str_], subject: NDArray[np.str_], sequence: NDArray[np.str_]
) -> NDArray[np.bool_]:
    """Which references belong to a split, shape (R,).

    Args:
        split: A given split, or one of a scheme's.
        given: The split that each reference was given, shape (R,).
        subject: Whose recording each comes from; empty where that is unknown, shape (R,).
        sequence: Name of the recording, shape (R,).
    """
    if split not in SCHEME_SPLITS:
        return np.asarray(given == split)
    scheme, part = split.split("/")
    if scheme == "by-subject":
        held_out = subject == HELD_OUT_SUBJECT
    else:
        held_out = np.array([_is_for_test(*names) for names in zip(subject, sequence, strict=True)], bool)
    return np.asarray(np.isin(given, PARTED) & (subject != "") & (held_out if part == "test" else ~held_out))


def _is_for_test(subject: str, sequence: str) -> bool:
    digest = hashlib.sha256(f"{subject}/{sequence}".encode()).digest()
    return int.from_bytes(digest, "big") % SEQUENCES_PER_TEST == 0
