"""Refinement of references whose faults are known by construction."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_surface import core_points
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import load_object
from artigrasp.assets.object_model import PartModel
from artigrasp.config import RefinementConfig
from artigrasp.kernels.layout import ARTICULATED, BASE, FINGER_DOF_COUNT, HANDS, LINK_COUNT, LINKS, WRIST_DOF_COUNT
from artigrasp.references.natural_pose import PRIOR_DEVIATION, fit_natural_pose, gather_natural_pose, mirror_fingers
from artigrasp.references.quality import CONTACT_DISTANCE, measure_contacts, pose_references
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.references.refinement import Energy, Refinement, is_refined, refine_references, with_refined
from tests.example_references import box_references

BOX = load_object("lidded-box")


def solid(bottom: float) -> PartModel:
    """A block 0.1 m thick, so that nothing pierces it."""
    block = trimesh.creation.box((0.4, 0.4, 0.1))
    return replace(
        BOX.parts[BASE], vertices=block.vertices + np.array([0, 0, bottom + 0.05]), faces=np.asarray(block.faces)
    )


BLOCKS = replace(BOX, parts=(solid(0.0), solid(0.1)))
HAND_MODELS = (load_hand("open", "left"), load_hand("open", "right"))
LEFT, RIGHT = range(2)
RELAXED = fit_natural_pose(np.zeros((0, FINGER_DOF_COUNT)))
QUICK = RefinementConfig(iterations=150, starts=1)
HEIGHTS = np.array([0.010, -0.010, 0.0])
"""Of the hand over the block [m]: floating, pushed into it, as it should be."""


def flat_hands() -> ReferenceSet:
    """Backs of flat right hands over, in and on the upper block, which they should touch; left ones take no part."""
    count = len(HEIGHTS)
    balls = core_points(HAND_MODELS[RIGHT])
    thickness = (balls.position[:, 1] + balls.radius)[balls.link == 0].max()
    wrist = np.zeros((count, 2, 7))
    # The back of the hand faces y of the wrist; turned by -90 degrees about x it faces downwards.
    wrist[:, :, 3:] = [-np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
    wrist[:, RIGHT, 0] = 0.05
    wrist[:, RIGHT, 2] = 0.2 + thickness + HEIGHTS
    contacts = np.zeros((count, 2, LINK_COUNT), bool)
    contacts[:, RIGHT, LINKS.index("wrist")] = True
    return ReferenceSet(
        object="lidded-box",
        hand="open",
        kind=np.full(count, "articulate"),
        split=np.full(count, "train"),
        active=np.tile([False, True], (count, 1)),
        part=np.tile([BASE, ARTICULATED], (count, 1)),
        wrist_pose_in_part=wrist,
        finger_angles=np.zeros((count, 2, FINGER_DOF_COUNT)),
        contacts=contacts,
        object_pose=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (count, 1)),
        object_angle=np.zeros(count),
        source=np.array([f"flat {height}" for height in HEIGHTS]),
    )


@pytest.fixture(scope="module")
def refined() -> Refinement:
    """The flat hands, refined."""
    return refine_references(flat_hands(), BLOCKS, HAND_MODELS, RELAXED, QUICK)


def test_measures_known_by_construction() -> None:
    """A hand 10 mm over the block misses its contact, one 10 mm inside is that deep, and beyond no limit."""
    references = flat_hands()
    measured = measure_contacts(references, BLOCKS, HAND_MODELS)
    np.testing.assert_allclose(measured.deepest[[0, 2]], 0, atol=1e-6)
    np.testing.assert_allclose(measured.deepest_in_own_part[1], 0.010, atol=1e-6)
    assert measured.deepest[1] >= measured.deepest_in_own_part[1]
    assert measured.mean_depth[1] >= 0.010 / LINK_COUNT
    assert measured.target_contacts.tolist() == [1, 1, 1]
    assert measured.missing_contacts.tolist() == [1, 0, 0]
    bent = replace(references, finger_angles=references.finger_angles + 0.5)
    upper = HAND_MODELS[RIGHT].upper[WRIST_DOF_COUNT:]
    expected = np.sqrt(np.mean(np.maximum(0.5 - upper, 0) ** 2))
    np.testing.assert_allclose(measure_contacts(bent, BLOCKS, HAND_MODELS).beyond_limits, expected, rtol=1e-5)


def test_floating_hands_come_down_and_deep_ones_come_out(refined: Refinement) -> None:
    """They touch then, having moved no farther than they were off, and turned a little; the one that touched stays."""
    measured = measure_contacts(refined.references, BLOCKS, HAND_MODELS)
    assert (measured.missing_contacts == 0).all()
    assert (measured.deepest < 0.002).all()
    assert (refined.moved[:2] > 0.004).all() and (refined.moved[:2] < 0.012).all()
    assert refined.moved[2] < 0.003
    assert (refined.end_energy <= refined.start_energy).all()
    assert (refined.end_energy[:2] < 0.2 * refined.start_energy[:2]).all()


def test_the_gradient_is_that_of_the_energy() -> None:
    """Along random directions, against central differences of the energy itself, with every term at work."""
    references = flat_hands()
    config = RefinementConfig(limits_scale=0.01)
    posed = pose_references(references, BLOCKS, HAND_MODELS, "cpu", requires_grad=True)
    energy = Energy(references, HAND_MODELS, RELAXED, config, posed)
    start = posed.hands.joint_q.numpy().copy()
    rng = np.random.default_rng(0)
    start += 0.02 * rng.normal(size=start.shape).astype(np.float32) * np.where(np.arange(start.shape[2]) < 3, 0.1, 1)
    posed.hands.joint_q.assign(start)
    _, gradient = energy.evaluate()
    step = 1e-4
    for _ in range(5):
        direction = rng.normal(size=start.shape).astype(np.float32)
        ends = []
        for sign in (1, -1):
            posed.hands.joint_q.assign(start + sign * step * direction)
            ends.append(energy.evaluate()[0].numpy())
        expected = (ends[0] - ends[1]) / (2 * step)
        found = np.einsum("whd,whd->w", gradient.numpy(), direction)
        np.testing.assert_allclose(found, expected, rtol=0.03, atol=0.01 * np.abs(expected).max())


def test_what_takes_no_part_keeps_its_numbers(refined: Refinement) -> None:
    """The left hands, contacts and everything about the object; the split says that they are refined."""
    before, after = flat_hands(), refined.references
    for name in ("wrist_pose_in_part", "finger_angles"):
        np.testing.assert_array_equal(getattr(after, name)[:, LEFT], getattr(before, name)[:, LEFT])
    for name in ("kind", "active", "part", "contacts", "object_pose", "object_angle"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert after.split.tolist() == ["train-refined"] * 3
    assert all(is_refined(split) for split in after.split) and not is_refined("train")
    assert after.source[0] == "flat 0.01, refined"


def test_refining_again_changes_little(refined: Refinement) -> None:
    """What is refined is where it should be."""
    again = refine_references(refined.references, BLOCKS, HAND_MODELS, RELAXED, QUICK)
    assert (again.moved < 0.002).all() and (again.bent < 0.05).all()


def test_more_starts_are_never_worse_and_repeatable() -> None:
    """The first start is undisturbed, so the best of several is at least as good; a seed gives one result."""
    references = box_references()
    few = RefinementConfig(iterations=20, starts=1)
    one = refine_references(references, BOX, HAND_MODELS, RELAXED, few)
    several = [refine_references(references, BOX, HAND_MODELS, RELAXED, replace(few, starts=3)) for _ in range(2)]
    assert (several[0].end_energy <= one.end_energy * (1 + 1e-5)).all()
    np.testing.assert_array_equal(several[0].references.finger_angles, several[1].references.finger_angles)


def test_both_hands_and_either_part() -> None:
    """In a grasp a link may touch either part; both hands are refined, each in its own part's frame."""
    one = flat_hands()
    wrist = one.wrist_pose_in_part.copy()
    wrist[:, LEFT] = wrist[:, RIGHT] * [-1, 1, 1, 1, -1, -1, 1]
    contacts = one.contacts.copy()
    contacts[:, LEFT] = contacts[:, RIGHT]
    both = replace(
        one,
        kind=np.full(3, "grasp"),
        part=np.zeros((3, 2)).astype(np.int32),
        active=np.ones((3, 2), bool),
        wrist_pose_in_part=wrist,
        contacts=contacts,
    )
    result = refine_references(both, BLOCKS, HAND_MODELS, RELAXED, QUICK)
    measured = measure_contacts(result.references, BLOCKS, HAND_MODELS)
    assert (measured.missing_contacts == 0).all() and (measured.deepest < 0.002).all()
    # The scene is the same in a mirror, and the hands are each other's mirror image.
    poses = result.references.wrist_pose_in_part
    np.testing.assert_allclose(poses[:, LEFT], poses[:, RIGHT] * [-1, 1, 1, 1, -1, -1, 1], atol=2e-3)


def test_refined_references_join_the_others(refined: Refinement) -> None:
    """They come after those of other splits, replace earlier refined ones, and the file says how they were made."""
    whole = with_refined(flat_hands(), refined.references, QUICK)
    assert whole.split.tolist() == ["train"] * 3 + ["train-refined"] * 3
    twice = with_refined(whole, refined.references.select(indices=[0]), QUICK)
    assert twice.split.tolist() == ["train"] * 3 + ["train-refined"]
    assert '"made_by": "refine-references"' in whole.provenance and '"iterations": 150' in whole.provenance


def test_nothing_recorded_leaves_a_relaxed_flat_hand() -> None:
    """Without poses the Gaussian is the prior."""
    np.testing.assert_array_equal(RELAXED.mean, 0)
    np.testing.assert_allclose(RELAXED.whitening, np.eye(FINGER_DOF_COUNT) / PRIOR_DEVIATION)
    assert RELAXED.count == 0


def test_many_poses_speak_for_themselves() -> None:
    """The mean is theirs, and whitened they have independent coordinates of deviation 1."""
    rng = np.random.default_rng(0)
    mixing = 0.3 * rng.normal(size=(FINGER_DOF_COUNT, FINGER_DOF_COUNT))
    poses = 0.5 + rng.normal(size=(20_000, FINGER_DOF_COUNT)) @ mixing.T
    natural = fit_natural_pose(poses)
    np.testing.assert_allclose(natural.mean, 0.5, atol=0.05)
    whitened = (poses - natural.mean) @ natural.whitening.T
    np.testing.assert_allclose(np.cov(whitened.T)[:5, :5], np.eye(5), atol=0.1)


def test_hands_of_both_sides_are_gathered() -> None:
    """Every active hand of the shipped train references counts once; a mirrored hand is mirrored back."""
    natural = gather_natural_pose("open")
    shipped = [load_references(name) for name in list_assets("references")]
    of_hand = [each.select(split="train") for each in shipped if each.hand == "open"]
    assert natural.count == sum(each.active.sum() for each in of_hand) > 0
    assert (natural.mean[5::9][:4] > 0).all()  # middle joints of fingers are flexed about z
    angles = np.random.default_rng(0).normal(size=(4, FINGER_DOF_COUNT))
    np.testing.assert_array_equal(mirror_fingers(mirror_fingers(angles)), angles)
    assert CONTACT_DISTANCE < 0.01 and len(HANDS) == 2
