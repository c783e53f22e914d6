"""One policy for both hands: the mirror shows it what a hand of the other side would see in a mirrored world."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from artigrasp.config import ActionConfig, ResidualConfig, SynergyConfig, TaskConfig
from artigrasp.controllers.controller import PolicyController
from artigrasp.controllers.mirror import hinge_axis_in_part, mirror_actions, mirror_features
from artigrasp.kernels.layout import DOF_COUNT, FEATURES, feature_slice
from artigrasp.kernels.synergies import SYNERGIES
from artigrasp.tasks import get_task
from tests.controllers.examples import example_policy
from tests.kernels.launches import launch_features
from tests.kernels.samples import Sample, mirror_sample, random_sample, to_device
from tests.kernels.test_actions import HINGE, PAPER, targets

BOTH_TERMS = ActionConfig(wrist_prior="hinge", finger_prior="reference", synergy=SynergyConfig(squeeze=0.1, press=0.02))
PER_HAND = (
    "joint_q", "joint_qd", "hand_base", "contact_force", "active", "part", "contact_part", "wrist_pose_in_part",
    "finger_angles", "keypoint_in_part", "contacts",
)  # fmt: skip


def turn_object_frames(sample: Sample, turn: Rotation) -> Sample:
    """The same scene with frames of the objects [W] turned about their origins, and all that is given in them."""

    def poses(values: np.ndarray, before: bool) -> np.ndarray:
        per_world = [turn[world].inv() if before else turn[world] for world in range(len(values))]
        result = values.copy()
        for world, rotation in enumerate(per_world):
            own = Rotation.from_quat(values[world, ..., 3:])
            result[world, ..., 3:] = (rotation * own if before else own * rotation).as_quat()
            if before:
                result[world, ..., :3] = rotation.apply(values[world, ..., :3])
        return result

    def vectors(values: np.ndarray) -> np.ndarray:
        rows = [turn[world].inv().apply(each.reshape(-1, 3)) for world, each in enumerate(values)]
        return np.stack(rows).reshape(values.shape)

    return replace(
        sample,
        **{name: poses(getattr(sample, name), before=False) for name in ("pose", "start_object_pose")},
        wrist_pose_in_part=poses(sample.wrist_pose_in_part, before=True),
        **{name: vectors(getattr(sample, name)) for name in ("hinge_origin", "hinge_axis", "keypoint_in_part")},
    )


def mirrored_scene(sample: Sample) -> Sample:
    """The scene in a mirror, left hands now right ones and the other way round, hinge axes and their senses kept."""
    mirrored = mirror_sample(sample)
    swapped = {name: getattr(mirrored, name)[:, ::-1] for name in PER_HAND}
    swapped |= {name: getattr(mirrored, name)[::-1] for name in ("link_offset", "tip_offset")}
    # the mirror took the frames' x: what it should take is the direction of the hinge
    x = np.diag([-1.0, 1.0, 1.0])
    planes = np.eye(3) - 2.0 * sample.hinge_axis[:, :, None] * sample.hinge_axis[:, None, :]
    return turn_object_frames(replace(mirrored, **swapped), Rotation.from_matrix(x @ planes))


@pytest.fixture(scope="module")
def sample() -> Sample:
    """Random states of two hands and an object."""
    return random_sample(world_count=40, seed=3)


@pytest.fixture(scope="module")
def mirrored(sample: Sample) -> Sample:
    """The same in the mirror."""
    return mirrored_scene(sample)


@pytest.fixture(scope="module")
def features(sample: Sample) -> np.ndarray:
    """[W, H, 279] of the states."""
    return launch_features(to_device(sample)).numpy()


def test_the_mirrored_scene_keeps_hinges(sample: Sample, mirrored: Sample) -> None:
    """The example is what it should be: hinge axes in the object's frame stay, and so does a mirrored mirror image."""
    np.testing.assert_allclose(mirrored.hinge_axis, sample.hinge_axis, atol=1e-6)
    again = mirrored_scene(mirrored)
    for field in fields(sample):
        found, expected = getattr(again, field.name), getattr(sample, field.name)
        if field.name in ("pose", "start_object_pose", "wrist_pose_in_part"):  # of a quaternion either sign will do
            found, expected = (np.abs(values) for values in (found, expected))
        if field.name not in ("object_pose", "target_object_pose"):
            np.testing.assert_allclose(found, expected, atol=1e-5, err_msg=field.name)


@pytest.mark.parametrize("name", [feature.name for feature in FEATURES])
def test_mirroring_the_scene_mirrors_the_features(features: np.ndarray, mirrored: Sample, name: str) -> None:
    """What hands see in the mirrored scene is the mirror image of what their counterparts see."""
    found = mirror_features(torch.from_numpy(features)).numpy()[:, ::-1]
    expected = launch_features(to_device(mirrored)).numpy()
    columns = feature_slice(name)
    np.testing.assert_allclose(found[..., columns], expected[..., columns], rtol=1e-4, atol=1e-4)


def test_hinges_lie_where_the_object_has_them(features: np.ndarray, sample: Sample) -> None:
    """The features tell the hinge's axis in the part's frame; where they hide it, it is z."""
    found = hinge_axis_in_part(torch.from_numpy(features)).numpy()
    expected = np.broadcast_to(sample.hinge_axis[:, None], found.shape)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    hidden = launch_features(to_device(sample), with_hinge=False).numpy()
    assert (hinge_axis_in_part(torch.from_numpy(hidden)).numpy() == [0.0, 0.0, 1.0]).all()
    twice = mirror_features(mirror_features(torch.from_numpy(hidden))).numpy()
    np.testing.assert_allclose(twice, hidden, atol=1e-4)


def test_mirrored_actions_have_mirrored_targets(features: np.ndarray, sample: Sample, mirrored: Sample) -> None:
    """Both terms: the mirror image of an action sends the mirrored hands to the mirror image of its targets."""
    rng = np.random.default_rng(1)
    actions = rng.normal(size=(*features.shape[:2], len(SYNERGIES) + DOF_COUNT)).astype(np.float32)
    image = mirror_actions(*map(torch.from_numpy, (actions, features)), BOTH_TERMS).numpy()[:, ::-1]
    for prior in (PAPER, HINGE):
        step = 90
        synergy, residual = np.split(actions, [len(SYNERGIES)], axis=-1)
        straight = targets(sample, prior, step, synergy, residual)
        synergy, residual = np.split(image, [len(SYNERGIES)], axis=-1)
        found = targets(mirrored, prior, step, synergy, residual)
        signs = np.array([-1.0, 1.0, 1.0, *([1.0, -1.0, -1.0] * 16)])
        difference = found - straight[:, ::-1] * signs
        difference[..., 3:6] = np.mod(difference[..., 3:6] + np.pi, 2 * np.pi) - np.pi
        np.testing.assert_allclose(difference, 0.0, atol=2e-4)


@pytest.mark.parametrize("config", [ActionConfig(), BOTH_TERMS, replace(BOTH_TERMS, residual=None)])
def test_mirroring_twice_changes_nothing(features: np.ndarray, config: ActionConfig) -> None:
    """For features and for every kind of action."""
    seen = torch.from_numpy(features)
    np.testing.assert_allclose(mirror_features(mirror_features(seen)).numpy(), features, atol=1e-4)
    count = sum((len(SYNERGIES) if config.synergy else 0, DOF_COUNT if config.residual else 0))
    actions = torch.randn(*seen.shape[:2], count, generator=torch.Generator().manual_seed(0))
    twice = mirror_actions(mirror_actions(actions, seen, config), mirror_features(seen), config)
    np.testing.assert_allclose(twice.numpy(), actions.numpy(), atol=1e-4)


def policy_task(name: str, **changes: object) -> TaskConfig:
    """A task's scene with a policy that decides on both terms."""
    return replace(get_task(name), action=replace(BOTH_TERMS, residual=ResidualConfig()), **changes)


def test_a_mirrored_policy_treats_both_hands_alike(features: np.ndarray, mirrored: Sample) -> None:
    """Left hands act in the mirrored scene as right ones do in the scene, and the other way round."""
    task = policy_task("both-free", policies="mirrored")
    controller = PolicyController(example_policy(task))
    actions = controller.act(features)
    image = controller.act(np.ascontiguousarray(launch_features(to_device(mirrored)).numpy()))
    expected = mirror_actions(*map(torch.from_numpy, (actions, features)), task.action).numpy()[:, ::-1]
    np.testing.assert_allclose(image, expected, atol=1e-3)
    assert np.abs(actions[:, 0] - actions[:, 1]).max() > 0.1


def test_a_hand_without_a_network_is_the_others_mirror_image(features: np.ndarray) -> None:
    """A right hand's policy in a scene of two hands."""
    task = policy_task("right-fixed")
    controller = PolicyController(example_policy(task))
    controller.task = replace(task, hands=("left", "right"))
    as_mirrored = replace(example_policy(task), task=policy_task("both-free", policies="mirrored"))
    as_mirrored = replace(as_mirrored, actors={"mirrored": as_mirrored.actors["right"]})
    np.testing.assert_array_equal(controller.act(features), PolicyController(as_mirrored).act(features))


def test_each_hand_has_its_own_network(features: np.ndarray) -> None:
    """With policies of their own, hands see the scene as it is."""
    policy = example_policy(policy_task("both-free"))
    assert list(policy.actors) == ["left", "right"]
    both = PolicyController(policy).act(features)
    for hand, side in enumerate(("left", "right")):
        task = policy_task("right-fixed", hands=(side,))
        alone = PolicyController(replace(policy, task=task, actors={side: policy.actors[side]}))
        np.testing.assert_array_equal(alone.act(features[:, hand : hand + 1]), both[:, hand : hand + 1])
