"""Learning again from a part of what was tried."""

from dataclasses import replace

import pytest
import torch

from artigrasp.assets.library import find_file
from artigrasp.controllers.policy_file import PolicyFile, load_policy
from artigrasp.training.replay import COLUMNS
from tools import relearn


def checkpoint_with(count: int) -> PolicyFile:
    """A checkpoint of seven worlds with three objects that holds so many decisions, whose rewards number them."""
    policy = load_policy(find_file("policies", "open-set-articulate"))
    memory = {name: torch.arange(count, dtype=torch.float32) for name in COLUMNS}
    learner = {"learners": {"right": {"memory": memory}}}
    task = replace(policy.task, world_count=7)
    return replace(policy, task=task, objects=("a", "b", "c"), learner=learner)


def test_what_was_tried_on_some_objects_is_told_by_the_world() -> None:
    """Worlds are shared as in training, side by side, in the order of the objects."""
    memory = relearn.remembered(checkpoint_with(14), "right", ["a", "c"])
    assert memory["reward"].tolist() == [0, 1, 2, 5, 6, 7, 8, 9, 12, 13]
    assert len(relearn.remembered(checkpoint_with(14), "right", None)["reward"]) == 14


def test_decisions_whose_worlds_are_unknown_are_refused() -> None:
    """Those of episodes whose physics failed are not kept, and the others move up."""
    with pytest.raises(SystemExit, match="some failed"):
        relearn.remembered(checkpoint_with(13), "right", ["a"])
