"""The tasks themselves: what they claim to be, and that they differ in what they should differ in."""

from dataclasses import fields, replace

import pytest

from artigrasp.config import CurriculumConfig, RewardConfig, TaskConfig, from_dict, to_dict
from artigrasp.errors import UserError
from artigrasp.tasks import CURRICULA, TASKS, artigrasp, get_curriculum, get_task, right_free_replay
from artigrasp.tasks.objects import PAPER_OBJECTS


def differences(first: TaskConfig, second: TaskConfig) -> set[str]:
    """Fields in which two tasks differ, but for what they are called."""
    names = {each.name for each in fields(TaskConfig)} - {"name", "description"}
    return {name for name in names if getattr(first, name) != getattr(second, name)}


def test_names_are_unique_and_kept() -> None:
    """A task or curriculum is found by its name, and by one only."""
    assert not TASKS.keys() & CURRICULA.keys()
    for name in TASKS:
        assert get_task(name).name == name
        assert get_curriculum(name).stages == (TASKS[name],)
    for name in CURRICULA:
        assert get_curriculum(name).name == name and get_curriculum(name).description


def test_everything_survives_json() -> None:
    """What a run folder keeps is what was trained."""
    for curriculum in CURRICULA.values():
        assert from_dict(CurriculumConfig, to_dict(curriculum)) == curriculum


def test_the_papers_phases() -> None:
    """Each hand alone on fixed objects, then both on free ones; nothing else differs but who, what and how long."""
    right, left, both = artigrasp.ARTIGRASP.stages
    assert (right.hands, left.hands, both.hands) == (("right",), ("left",), ("left", "right"))
    assert (right.kinds, left.kinds, both.kinds) == (("articulate", "grasp"), ("grasp",), ("articulate", "grasp"))
    assert differences(right, left) == {"hands", "kinds", "iterations"}
    assert differences(right, both) == {"hands", "fixed_base", "iterations"}
    assert right.fixed_base and both.reward == RewardConfig() and both.networks == ("left", "right")
    assert both.reset.idle_distance == 0.3


def test_each_ablation_leaves_out_one_thing() -> None:
    """No curriculum, no training together, no hinge features; everything else is the paper's method."""
    whole = artigrasp.ARTIGRASP.stages
    (alone,) = get_curriculum("artigrasp-without-curriculum").stages
    assert differences(alone, whole[-1]) == {"iterations"}
    separate = get_curriculum("artigrasp-without-cooperation").stages
    assert separate[:2] == whole[:2] and separate[2] == replace(whole[2], iterations=0)
    blind = get_curriculum("artigrasp-without-hinge-features").stages
    assert all(differences(*pair) == {"include_hinge_features"} for pair in zip(blind, whole, strict=True))


def test_each_ablation_of_ours_changes_one_thing() -> None:
    """And says what by its name."""
    changed = {each.name: differences(each, right_free_replay.TASK) for each in right_free_replay.ABLATIONS}
    assert changed == {
        "right-free-replay-follow": {"action"},
        "right-free-replay-all-features": {"ppo"},
        "right-free-replay-without-hinge-features": {"include_hinge_features"},
        "right-free-replay-without-doubt": {"replay"},
        "right-free-replay-without-jitter": {"reset"},
        "right-free-ppo": {"replay"},
    }


@pytest.mark.parametrize("name", PAPER_OBJECTS)
def test_one_object_is_left_out(name: str) -> None:
    """The paper's method on the other seven."""
    curriculum = get_curriculum(f"artigrasp-without-{name}")
    assert curriculum.stages == artigrasp.ARTIGRASP.stages
    assert set(curriculum.objects) == set(PAPER_OBJECTS) - {name} and len(curriculum.objects) == 7


def test_d_grasp_learns_grasps_and_knows_no_hinge() -> None:
    """It has neither the paper's features nor its task reward."""
    task = get_task("d-grasp")
    assert task.kinds == ("grasp",) and not task.include_hinge_features
    assert (task.reward.angle, task.reward.displacement) == (0.0, 0.0) and not task.fixed_base


def test_an_unknown_task_is_named() -> None:
    """With the nearest that there is, among tasks and curricula."""
    with pytest.raises(UserError, match="did you mean 'artigrasp-without-laptop'"):
        get_curriculum("artigrasp-without-laptops")


def test_stages_fit_together() -> None:
    """Networks of one shape, and at least one stage."""
    stage = get_task("right-fixed")
    smaller = replace(stage, ppo=replace(stage.ppo, hidden_sizes=(64,)))
    with pytest.raises(UserError, match="stages: expected networks and actions of one shape"):
        CurriculumConfig("two", "", (stage, smaller))
    with pytest.raises(UserError, match="stages: expected at least one"):
        CurriculumConfig("none", "", ())
    with pytest.raises(UserError, match="name: expected lower case words"):
        CurriculumConfig("Two Words", "", (stage,))
