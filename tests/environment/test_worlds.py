"""Which world plays what."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.environment import make
from artigrasp.environment.worlds import DRAW_GOAL, training_worlds, trial_worlds
from artigrasp.errors import UserError
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks import get_task
from tests.example_references import box_references


def sets(*counts: int) -> list[ReferenceSet]:
    """One set per object, with so many references."""
    chosen = [box_references().select(indices=np.zeros(count, int)) for count in counts]
    return [replace(each, object=f"object-{index}") for index, each in enumerate(chosen)]


def test_training_shares_worlds_evenly() -> None:
    """Worlds of one object stand side by side, and each draws from all references of its object and a goal."""
    plan = training_worlds(sets(3, 1, 4), 8)
    assert plan.world_count == 8
    assert plan.object_index.tolist() == [0, 0, 0, 1, 1, 1, 2, 2]
    assert plan.first_reference.tolist() == [0, 0, 0, 3, 3, 3, 4, 4]
    assert plan.reference_count.tolist() == [3, 3, 3, 1, 1, 1, 4, 4]
    assert (plan.goal_angle == DRAW_GOAL).all()


def of_kinds(*kinds: str) -> ReferenceSet:
    """A set with references of these kinds."""
    return replace(sets(len(kinds))[0], kind=np.array(kinds))


def test_kinds_have_equal_shares_of_an_objects_worlds() -> None:
    """Few articulations among many grasps are played as often; an object with one kind plays that."""
    references = [of_kinds("articulate", "grasp", "grasp", "grasp"), of_kinds("grasp", "grasp")]
    plan = training_worlds(references, 8, evenly_of_kinds=True)
    assert plan.object_index.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    assert plan.first_reference.tolist() == [0, 0, 1, 1, 4, 4, 4, 4]
    assert plan.reference_count.tolist() == [1, 1, 3, 3, 2, 2, 2, 2]
    alone = training_worlds(references, 2, evenly_of_kinds=True)
    assert alone.reference_count.tolist() == [4, 2], "a single world draws from all"


def test_hands_play_what_they_take_part_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """References of a task's kinds for its hands, one kind after the other."""
    active = np.array([[True, False], [False, True], [True, True], [False, True]])
    references = replace(of_kinds("grasp", "grasp", "articulate", "articulate"), active=active)
    monkeypatch.setattr(make, "load_references", lambda name: references)
    right, left = get_task("right-fixed"), get_task("left-fixed")
    assert make.training_references(right, ["box"], "train")[0].kind.tolist() == ["articulate", "articulate", "grasp"]
    (found,) = make.training_references(left, ["box"], "train")
    assert found.active.tolist() == [[True, False]]
    monkeypatch.setattr(make, "load_references", lambda name: references.select(indices=[1]))
    with pytest.raises(UserError, match="of the left hand: found none"):
        make.training_references(left, ["box"], "train")


@pytest.mark.parametrize("world_count", [5, 7, 64])
def test_no_object_is_left_out(world_count: int) -> None:
    """However the numbers divide, shares differ by one world at most."""
    counts = np.bincount(training_worlds(sets(1, 2, 3, 4, 5), world_count).object_index, minlength=5)
    assert counts.max() - counts.min() <= 1


def test_too_few_worlds_are_refused() -> None:
    """An object without a world would not be trained on at all."""
    with pytest.raises(UserError, match=r"worlds: expected at least one per object \(3\), found 2"):
        training_worlds(sets(1, 1, 1), 2)


def test_trials_are_every_reference_and_goal_once() -> None:
    """One world each, whose reference and goal are fixed."""
    plan = trial_worlds(sets(2, 1), [0.5, 1.5])
    assert plan.object_index.tolist() == [0, 0, 0, 0, 1, 1]
    assert plan.first_reference.tolist() == [0, 0, 1, 1, 2, 2]
    assert plan.reference_count.tolist() == [1] * 6
    assert plan.goal_angle.tolist() == [0.5, 1.5] * 3


def test_an_object_without_references_is_named() -> None:
    """Nothing to play is the user's mistake."""
    empty = sets(1, 0)
    for plan in (lambda: training_worlds(empty, 4), lambda: trial_worlds(empty, [1.0])):
        with pytest.raises(UserError, match="object-1: expected at least one reference"):
            plan()
