"""Distances of posed hands from objects: known by construction, and their gradients against differences."""

import numpy as np
import pytest
import warp as wp

from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_surface import core_points
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import ARTICULATED, BASE, DOF_COUNT, HANDS, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import HandDistance, PartMeshes, link_distances, pose_parts_in_base
from tests.kernels import numpy_reference
from tests.kernels.samples import random_poses
from tests.mesh_reference import signed_distance, surface

BOX = load_object("lidded-box")
HAND_MODELS = [load_hand("open", side) for side in HANDS]
WORLDS = 2


def example(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint coordinates [W, 2, 51], base frames [W, 2, 7] near the box, and hinge angles [W]."""
    rng = np.random.default_rng(seed)
    joint_q = rng.uniform(-0.4, 0.4, (WORLDS, 2, DOF_COUNT))
    joint_q[..., :3] *= 0.05
    base = random_poses(rng, WORLDS, 2, spread=0.12)
    base[..., 2] += 0.08
    return joint_q.astype(np.float32), base.astype(np.float32), rng.uniform(0, 1, WORLDS)


def reference_distances(joint_q: np.ndarray, base: np.ndarray, angle: np.ndarray, reach: float) -> np.ndarray:
    """Distances [W, 2, P, 2] of the hands' balls in double precision."""
    wrist = (numpy_reference.euler_matrix(joint_q[..., 3:6]), joint_q[..., :3])
    offsets = np.stack([hand.link_offset for hand in HAND_MODELS])
    tips = np.stack([hand.tip_offset for hand in HAND_MODELS])
    root = numpy_reference.compose(numpy_reference.frame(base), wrist)
    links, _ = numpy_reference.hand_frames(root, joint_q[..., 6:], offsets, tips)
    parts = numpy_reference.frame(pose_parts_in_base(BOX, angle).astype(np.float64))
    result = []
    for hand, model in enumerate(HAND_MODELS):
        balls = core_points(model)
        rotation = np.stack([links[link][0][:, hand] for link in balls.link], axis=1)
        origin = np.stack([links[link][1][:, hand] for link in balls.link], axis=1)
        centre = np.einsum("wpij,pj->wpi", rotation, balls.position) + origin
        of_part = []
        for part in (BASE, ARTICULATED):
            local = np.einsum("wji,wpj->wpi", parts[0][:, part], centre - parts[1][:, None, part])
            distance = signed_distance(surface(BOX, part), local.reshape(-1, 3))[0].reshape(centre.shape[:2])
            of_part.append(np.minimum(distance, reach) - balls.radius)
        result.append(np.stack(of_part, axis=-1))
    return np.stack(result, axis=1)


def fill(distance: HandDistance, joint_q: np.ndarray, base: np.ndarray, angle: np.ndarray) -> HandDistance:
    """Set the configuration."""
    distance.hands.joint_q.assign(joint_q)
    distance.hands.hand_base.assign(base)
    distance.part_pose.assign(pose_parts_in_base(BOX, angle))
    return distance


@pytest.fixture(scope="module")
def meshes() -> PartMeshes:
    """The box on the device."""
    return PartMeshes([BOX], "cpu")


def test_values_and_gradients(meshes: PartMeshes) -> None:
    """Both hands and both parts: distances, and their gradient by every joint coordinate."""
    joint_q, base, angle = example()
    distance = HandDistance(HAND_MODELS, meshes, np.zeros(WORLDS, int), requires_grad=True)
    fill(distance, joint_q, base, angle)
    with wp.Tape() as tape:
        distance.launch()
    joint_q = joint_q.astype(np.float64)
    expected = reference_distances(joint_q, base, angle, distance.reach)
    np.testing.assert_allclose(distance.distance.numpy(), expected, atol=3e-6)
    assert 0.02 < (expected < 0).mean() < 0.5

    # Few points at a time, for where two closest points compete a difference is none of a smooth function.
    rng = np.random.default_rng(1)
    weight = np.where(rng.random(expected.shape) < 0.2, rng.normal(size=expected.shape), 0.0)
    tape.backward(grads={distance.distance: wp.array(weight, dtype=float)})
    gradient = distance.hands.joint_q.grad.numpy()
    step = 1e-6
    for _ in range(8):
        direction = rng.normal(size=joint_q.shape)
        change = reference_distances(joint_q + step * direction, base, angle, distance.reach)
        change = change - reference_distances(joint_q - step * direction, base, angle, distance.reach)
        difference = np.sum(weight * change, axis=(2, 3)) / (2 * step)
        found = np.sum(gradient * direction, axis=2)
        np.testing.assert_allclose(found, difference, rtol=2e-2, atol=2e-2 * np.abs(difference).max())


def test_links_by_their_nearest_ball(meshes: PartMeshes) -> None:
    """A link is as far as its nearest ball, and `nearest` says which that is."""
    joint_q, base, angle = example(2)
    distance = HandDistance(HAND_MODELS, meshes, np.zeros(WORLDS, int))
    fill(distance, joint_q, base, angle).launch()
    balls, of_links = distance.distance.numpy(), distance.link_distance.numpy()
    for hand, model in enumerate(HAND_MODELS):
        link_of = core_points(model).link
        expected = np.stack([balls[:, hand, link_of == link].min(axis=1) for link in range(16)], axis=1)
        np.testing.assert_array_equal(of_links[:, hand], expected)
        nearest = distance.nearest.numpy()[:, hand]
        np.testing.assert_array_equal(np.take_along_axis(balls[:, hand], nearest, axis=1), expected)
        assert (link_of[nearest] == np.arange(16)[:, None]).all()


def test_link_distances_known_by_construction() -> None:
    """A flat palm 10 mm above the closed lid, and 10 mm inside it; more configurations than fit in a batch."""
    hand = HAND_MODELS[1]
    count = 300
    top = BOX.parts[ARTICULATED].vertices[:, 2].max()
    balls = core_points(hand)
    lowest = (balls.position[:, 1] - balls.radius)[balls.link == 0].min()
    height = np.where(np.arange(count) % 2, 0.01, -0.01)
    poses = np.zeros((count, 1, 7))
    # The palm faces -y of the wrist; turned by 90 degrees about x it faces downwards.
    poses[:, 0, 3:] = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
    poses[:, 0, 2] = top - lowest + height
    poses[:, 0, 0] = 0.05
    found = link_distances(BOX, [hand], poses, np.zeros((count, 1, DOF_COUNT - WRIST_DOF_COUNT)), np.zeros(count))
    assert found.shape == (count, 1, 16, 2)
    np.testing.assert_allclose(found[:, 0, 0, ARTICULATED], height, atol=1e-6)
