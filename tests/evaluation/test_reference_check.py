"""References that work, and some that cannot."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.config import SimulatorConfig
from artigrasp.evaluation.reference_check import PD_IK, SEARCH, ReferenceCheck, check_references
from artigrasp.references.reference import join_references, load_references

ONE_THREAD = SimulatorConfig(threads=1)


def test_a_hand_beside_the_box_opens_nothing() -> None:
    """One of the shipped references works with PD+IK; moved away from the box it does not."""
    good = load_references("lidded-box").select(kind="articulate", indices=range(4))
    wrist = good.wrist_pose_in_part.copy()
    wrist[..., 0] += 0.3
    far = replace(good, wrist_pose_in_part=wrist, source=np.array([f"{source}, far" for source in good.source]))
    check = check_references(join_references([good, far]), trials=1, simulator=ONE_THREAD)
    assert check.works[:4].any() and not check.works[4:].any()
    assert set(check.verdict[check.works].tolist()) == {PD_IK} and (check.success[4:] == 0).all()


def test_kinds_are_not_mixed() -> None:
    """They are tried in different experiments."""
    with pytest.raises(ValueError, match="expected those of one kind, found articulate, grasp"):
        check_references(load_references("lidded-box"))


def test_a_search_adds_to_what_works() -> None:
    """What fails again keeps its verdict and its share."""
    first = ReferenceCheck(np.array([PD_IK, "", ""]), np.array([1.0, 0.0, 0.3]))
    second = first.update(np.array([1, 2]), ReferenceCheck(np.array([SEARCH, ""]), np.array([1.0, 0.0])))
    assert second.verdict.tolist() == [PD_IK, SEARCH, ""] and second.success.tolist() == [1.0, 1.0, 0.3]
    assert len(first.join(second).verdict) == 6
