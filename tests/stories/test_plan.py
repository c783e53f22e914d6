"""What steps of a story come to, on situations made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.config.story import CloseStep, MoveStep, OpenStep, PlacedObject, ReleaseStep, Step, StoryConfig
from artigrasp.environment.worlds import DRAW_GOAL
from artigrasp.errors import UserError
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.stories.plan import Hold, Situation, plan_step, step_objective, target_pose
from artigrasp.stories.start import check_angles, first_instant, scatter_objects

STORY = StoryConfig(
    objects={
        "box": PlacedObject("open-box", (0.0, 0.0), yaw=np.pi / 2),
        "bottle": PlacedObject("open-ketchup-bottle", (0.4, -0.1)),
    },
    steps=(CloseStep(close="box"),),
)
OFFSETS = np.ones((1, 2, 14), np.float32)


@pytest.fixture(scope="module")
def references() -> list[ReferenceSet]:
    """Those of the story's objects."""
    return [load_references(each.asset) for each in STORY.objects.values()]


@pytest.fixture(scope="module")
def first(references: list[ReferenceSet]) -> Situation:
    """The story's beginning."""
    return Situation(first_instant(STORY, references, ("left", "right")))


def held_by_left(first: Situation, references: list[ReferenceSet], kind: str = "articulate") -> Situation:
    """The left hand holds the lid of the box."""
    left = references[0].select(kind=kind, hands=("left",), indices=0)
    return replace(first, holds={"left": Hold(0, left, OFFSETS)})


def names_of(step: Step, situation: Situation, references: list[ReferenceSet]) -> list[str]:
    """The phases of a step."""
    return [phase.name for phase in plan_step(step, STORY, situation, references).phases]


def test_hands_and_objects_begin_where_the_story_says(first: Situation) -> None:
    """Objects stand as in their references, turned; fingers look forward and palms down."""
    instant = first.instant
    np.testing.assert_allclose(instant.pose[:, :2], [[0.0, 0.0], [0.4, -0.1]], atol=1e-7)
    np.testing.assert_allclose(Rotation.from_quat(instant.pose[0, 3:]).as_rotvec(), [0, 0, np.pi / 2], atol=1e-6)
    np.testing.assert_allclose(instant.hand_base[:, :3], [STORY.left_hand, STORY.right_hand], atol=1e-7)
    # a right hand's fingers point to -x and its palm to -y
    for base, fingers in zip(instant.hand_base, (1.0, -1.0), strict=True):
        turn = Rotation.from_quat(base[3:])
        np.testing.assert_allclose(turn.apply([[fingers, 0, 0], [0, -1, 0]]), [[0, 1, 0], [0, 0, -1]], atol=1e-6)


def test_objects_may_begin_near_their_places() -> None:
    """Each by itself, within the ranges, alike for the same seed; without ranges the story is what it was."""
    assert scatter_objects(STORY, 0.0, 0.0, seed=1) == STORY
    drawn = [scatter_objects(STORY, 0.02, 0.3, seed) for seed in range(50)]
    assert scatter_objects(STORY, 0.02, 0.3, 7) == drawn[7] and drawn[7].steps == STORY.steps
    places = np.array([[(*each.at, each.yaw) for each in story.objects.values()] for story in drawn])
    off = places - [(*each.at, each.yaw) for each in STORY.objects.values()]
    largest = np.abs(off).max(axis=0)
    assert (largest <= [0.02, 0.02, 0.3]).all() and (largest > [0.017, 0.017, 0.25]).all()
    assert len(np.unique(off)) == off.size


def test_every_fitting_reference_is_tried(first: Situation, references: list[ReferenceSet]) -> None:
    """Of the hand that is named, else of all that are free, both where an object needs both."""
    box, bottle = references
    plan = plan_step(OpenStep(open="box", to=1.0, hand="left"), STORY, first, references)
    expected = (box.kind == "articulate") & box.active[:, 0] & ~box.active[:, 1]
    assert set(plan.references.source) == set(box.source[expected]) and plan.offsets is None
    assert plan.goal_angle == 1.0 and not plan.holds
    every = plan_step(OpenStep(open="box", to=1.0), STORY, first, references).references
    assert len(every) == (box.kind == "articulate").sum()
    both = plan_step(MoveStep(move="bottle", to=(0, 0, 0), hand="both"), STORY, first, references)
    assert both.references.active.all() and both.goal_angle == DRAW_GOAL
    free = plan_step(MoveStep(move="bottle", to=(0, 0, 0)), STORY, held_by_left(first, references), references)
    assert (free.references.active == [False, True]).all() and len(free.references) > 3
    assert len(free.references) < (bottle.kind == "grasp").sum()


def test_a_hand_on_the_object_goes_on(first: Situation, references: list[ReferenceSet]) -> None:
    """With its own reference and decisions and without coming anew; who should stay on it does not let go."""
    letting_go = ["release", "retreat", "withdraw"]
    assert names_of(CloseStep(close="box"), first, references) == ["transit", "articulate", *letting_go]
    situation = held_by_left(first, references)
    assert names_of(CloseStep(close="box"), situation, references) == ["articulate", *letting_go]
    plan = plan_step(CloseStep(close="box", hold=True), STORY, situation, references)
    assert [phase.name for phase in plan.phases] == ["articulate"] and plan.holds
    assert plan.references is situation.holds["left"].reference and plan.offsets is OFFSETS
    assert names_of(CloseStep(close="box", hand="right"), situation, references)[0] == "transit"
    assert names_of(ReleaseStep(release="left"), situation, references) == letting_go
    drop = MoveStep(move="bottle", to=(0.0, 0.0, 0.1), drop=0.1)
    assert [phase.name for phase in plan_step(drop, STORY, first, references).phases if phase.drops] == [
        "release",
        "withdraw",
    ], "what falls may turn over, and hands have nothing to draw out of"
    after = situation.after(first.instant, plan, plan.references, OFFSETS)
    assert after.holds["left"].slot == 0 and list(after.holds) == ["left"]
    let_go = plan_step(ReleaseStep(release="left"), STORY, situation, references)
    assert not situation.after(first.instant, let_go, let_go.references, OFFSETS).holds


def test_busy_hands_are_told(first: Situation, references: list[ReferenceSet]) -> None:
    """Nobody is there to do it, or has anything to let go of."""
    situation = held_by_left(first, references)
    with pytest.raises(UserError, match="open-ketchup-bottle: expected a grasp reference of the left hand, which is"):
        plan_step(MoveStep(move="bottle", to=(0, 0, 0), hand="left"), STORY, situation, references)
    with pytest.raises(UserError, match="expected a right hand that holds something, found one that holds nothing"):
        plan_step(ReleaseStep(release="right"), STORY, situation, references)


def test_references_under_the_table_are_left_out(first: Situation, references: list[ReferenceSet]) -> None:
    """As when the object has fallen on its side."""
    instant = first.instant
    pose = instant.pose.copy()
    pose[1] = [0.4, -0.1, 0.04, *Rotation.from_euler("y", np.pi / 2).as_quat()]
    lying = Situation(replace(instant, pose=pose))
    step = MoveStep(move="bottle", to=(0, 0, 0), hand="right")
    upright = plan_step(step, STORY, first, references).references
    found = plan_step(step, STORY, lying, references).references
    # the bottle's x points down
    above = upright.wrist_pose_in_part[:, 1, 0] < 0.02
    assert set(found.source) == set(upright.source[above]) and 0 < len(found) < len(upright)


def test_targets_may_be_on_other_objects(first: Situation) -> None:
    """Where these are now, turned with them; roll, pitch and yaw are about fixed axes."""
    step = MoveStep(move="bottle", to=(0.1, 0.0, 0.05), roll=0.2, pitch=0.3, yaw=0.4)
    names = list(STORY.objects)
    turn = Rotation.from_rotvec([0, 0, 0.4]) * Rotation.from_rotvec([0, 0.3, 0]) * Rotation.from_rotvec([0.2, 0, 0])
    pose = target_pose(step, names, first.instant)
    np.testing.assert_allclose(pose[:3], [0.1, 0.0, 0.05], atol=1e-6)
    assert (Rotation.from_quat(pose[3:]) * turn.inv()).magnitude() < 1e-6
    pose = target_pose(replace(step, relative_to="box"), names, first.instant)
    np.testing.assert_allclose(pose[:3], [0.0, 0.1, 0.05], atol=1e-6)
    assert (Rotation.from_quat(pose[3:]) * turn.inv()).as_rotvec() == pytest.approx([0, 0, np.pi / 2], abs=1e-6)


def test_a_step_is_done_where_it_should_be_and_leaves_the_others_alone() -> None:
    """How far it may be turned is up to the step."""
    fields = ("max_tilt", "position_error", "rotation_error", "bystander_shift", "bystander_turn", "failed")
    good = {name: np.zeros(1) for name in fields} | {"rotation_error": np.ones(1)}
    dropped = step_objective(MoveStep(move="bottle", to=(0, 0, 0), turn_tolerance=1.1), has_bystanders=True)
    put = step_objective(MoveStep(move="bottle", to=(0, 0, 0)), has_bystanders=True)
    assert dropped.success(good)[0] and not put.success(good)[0]
    assert not dropped.success(good | {"bystander_shift": np.full(1, 0.3)})[0]
    assert not dropped.success(good | {"position_error": np.full(1, 0.06)})[0]
    assert not any(name.startswith("bystander") for name in step_objective(ReleaseStep(release="left"), False).weights)


def test_angles_that_objects_do_not_open_to_are_refused() -> None:
    """With the key."""
    wide = replace(STORY, steps=(*STORY.steps, OpenStep(open="box", to=3.0)))
    with pytest.raises(UserError, match=r"steps\[1\]\.to: expected 0 to 2\.20 rad, as far as box opens, found 3"):
        check_angles(wide)
    placed = replace(STORY, objects={"box": PlacedObject("open-box", (0.0, 0.0), angle=-0.1)})
    with pytest.raises(UserError, match=r"objects\.box\.angle: expected 0 to"):
        check_angles(placed)
