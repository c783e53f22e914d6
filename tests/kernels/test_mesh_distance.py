"""Signed distances from meshes and their gradients, against a search of every triangle in double precision."""

import numpy as np
import pytest
import trimesh
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.library import list_assets
from artigrasp.assets.object import load_object
from artigrasp.assets.object_model import Mesh
from artigrasp.kernels import mesh_distance
from tests.kernels.samples import random_poses
from tests.mesh_reference import signed_distance, surface

REACH = 1.0
IDENTITY = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
FAR = np.array([99.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def launch(
    mesh: Mesh, points: np.ndarray, pose: np.ndarray = IDENTITY, radius: float = 0.0, reach: float = REACH
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distances [N], their gradients by the points and by the part's pose [N, 3], [7], and the closest points [N, 3].

    Both parts have this mesh; the second one is far away.
    """
    on_device = wp.Mesh(
        wp.array(mesh.vertices, dtype=wp.vec3), wp.array(mesh.faces.ravel(), dtype=int), support_winding_number=True
    )
    ids = wp.array(np.full((1, 2), on_device.id, np.uint64), dtype=wp.uint64)
    part_pose = wp.array(np.stack([pose, FAR])[None], dtype=wp.transform, requires_grad=True)
    position = wp.array(points[None, None], dtype=wp.vec3, requires_grad=True)
    shape = (1, 1, len(points), 2)
    closest, normal = wp.zeros(shape, dtype=wp.vec3), wp.zeros(shape, dtype=wp.vec3)
    distance = wp.zeros(shape, dtype=float, requires_grad=True)
    with wp.Tape() as tape:
        wp.launch(
            mesh_distance.find_closest_points,
            dim=shape,
            inputs=[ids, part_pose, position, reach],
            outputs=[closest, normal],
            record_tape=False,
        )
        radii = wp.full(shape[1:3], radius, dtype=float)
        wp.launch(
            mesh_distance.signed_distances,
            dim=shape,
            inputs=[part_pose, position, radii, closest, normal, reach],
            outputs=[distance],
        )
    weight = np.zeros(shape)
    weight[..., 0] = 1.0
    tape.backward(grads={distance: wp.array(weight, dtype=float)})
    assert (distance.numpy()[..., 1] == np.float32(reach) - np.float32(radius)).all()
    return (
        distance.numpy()[0, 0, :, 0],
        position.grad.numpy()[0, 0],
        part_pose.grad.numpy()[0, 0],
        closest.numpy()[0, 0, :, 0],
    )


def points_near(mesh: Mesh, count: int, spread: float = 0.01) -> np.ndarray:
    """Points around a surface, float32 numbers."""
    on_surface, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), count, seed=0
    )
    return (on_surface + np.random.default_rng(0).normal(0, spread, (count, 3))).astype(np.float32).astype(np.float64)


def check(mesh: Mesh, count: int) -> None:
    """Distances, closest points and gradients are those of the reference."""
    points = points_near(mesh, count)
    distance, gradient, _, closest = launch(mesh, points)
    expected, expected_closest = signed_distance(mesh, points)
    # On the surface itself rounding decides on which side a point is.
    apart = np.abs(expected) > 1e-5
    np.testing.assert_allclose(distance[apart], expected[apart], atol=2e-7)
    np.testing.assert_allclose(distance[~apart], 0, atol=1e-5)
    step = 1e-7
    differences = np.stack(
        [
            (signed_distance(mesh, points + step * axis)[0] - signed_distance(mesh, points - step * axis)[0])
            / (2 * step)
            for axis in np.eye(3)
        ],
        axis=-1,
    )
    # Where two closest points compete the gradient jumps.
    smooth = apart & (np.abs(np.linalg.norm(differences, axis=1) - 1) < 1e-4)
    assert smooth.mean() > 0.97
    assert_same_direction(gradient[smooth], differences[smooth], expected[smooth])
    same = np.linalg.norm(closest - expected_closest, axis=1) < 1e-5
    assert same.mean() > 0.97


def assert_same_direction(found: np.ndarray, expected: np.ndarray, distance: np.ndarray) -> None:
    """Gradients agree to what single precision leaves of the direction to a point at these distances."""
    error = np.linalg.norm(found - expected, axis=1)
    assert (error < 1e-3 + 1e-6 / np.abs(distance)).all(), error.max()


@pytest.mark.parametrize("part", [0, 1])
def test_the_lidded_box(part: int) -> None:
    """Both parts of the shipped box, one of which is put together from blocks."""
    check(surface(load_object("lidded-box"), part), 400)


@pytest.mark.usefixtures("arctic_assets")
@pytest.mark.parametrize("name", ["box", "laptop"])
def test_imported_objects(name: str) -> None:
    """The laptop's faces do not all turn the same way."""
    assert name in list_assets("objects")
    for part in (0, 1):
        check(surface(load_object(name), part), 100)


def test_a_mesh_with_a_hole() -> None:
    """A box that lacks two triangles of twelve still has an inside, and nothing is wrong far from the hole."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    kept = ~(box.face_normals[:, 2] > 0.5)
    mesh = Mesh(np.asarray(box.vertices), np.asarray(box.faces[kept]))
    points = np.array([[0, 0, -0.02], [0.03, 0, -0.03], [0, 0, 0.2], [0.06, 0, 0], [0, 0, -0.06]])
    distance, *_ = launch(mesh, points)
    np.testing.assert_allclose(distance, [-0.03, -0.02, np.hypot(0.05, 0.15), 0.01, 0.01], atol=1e-6)


def test_gradients_at_faces_edges_vertices_and_on_the_surface() -> None:
    """Unit vectors away from the closest point, also inside, and the face's normal for a point that lies in it."""
    box = trimesh.creation.box((2, 2, 2))
    points = np.array([[0.3, 0.2, 3], [3, 2, 0.1], [2, 2, 2], [0.3, 0.2, 0.9], [0.3, 0.2, 1]])
    distance, gradient, _, closest = launch(Mesh(np.asarray(box.vertices), np.asarray(box.faces)), points, reach=9.0)
    np.testing.assert_allclose(distance, [2, 5**0.5, 3**0.5, -0.1, 0], atol=1e-6)
    expected = np.array([[0, 0, 1], [2, 1, 0], [1, 1, 1], [0, 0, 1], [0, 0, 1]])
    np.testing.assert_allclose(gradient, expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=1e-5)
    np.testing.assert_allclose(closest[:3], [[0.3, 0.2, 1], [1, 1, 0.1], [1, 1, 1]], atol=1e-6)


def test_a_moved_part() -> None:
    """Distances move with the part, and their gradient by its position is opposite to that by the points."""
    mesh = surface(load_object("lidded-box"), 1)
    points = points_near(mesh, 100)
    pose = random_poses(np.random.default_rng(3), 1)[0]
    moved = Rotation.from_quat(pose[3:]).apply(points) + pose[:3]
    distance, gradient, pose_gradient, _ = launch(mesh, moved, pose)
    expected, in_part, _, _ = launch(mesh, points)
    np.testing.assert_allclose(distance, expected, atol=1e-6)
    assert_same_direction(gradient, Rotation.from_quat(pose[3:]).apply(in_part), expected)
    np.testing.assert_allclose(pose_gradient[:3], -gradient.sum(axis=0), rtol=1e-4, atol=1e-4)


def test_balls_and_reach() -> None:
    """A ball is nearer by its radius; what is out of reach counts as that far and passes no gradient."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    mesh = Mesh(np.asarray(box.vertices), np.asarray(box.faces))
    distance, gradient, *_ = launch(mesh, np.array([[0.06, 0, 0], [0.2, 0, 0]]), radius=0.004, reach=0.02)
    np.testing.assert_allclose(distance, [0.006, 0.016], atol=1e-6)
    np.testing.assert_allclose(gradient, [[1, 0, 0], [0, 0, 0]], atol=1e-5)
