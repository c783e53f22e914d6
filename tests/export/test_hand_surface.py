"""Tests of how hands look: skin and links are where kinematics have the hand."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from artigrasp.assets.hand import HandModel, load_hand, mirror
from artigrasp.export.hand_surface import BLEND, CELL, Skin, hand_surface, make_skin
from artigrasp.export.surface import Surface
from artigrasp.kernels.layout import LINK_COUNT, LINKS


@pytest.fixture(scope="module")
def hand() -> HandModel:
    """The open right hand."""
    return load_hand("open", "right")


@pytest.fixture(scope="module")
def skin(hand: HandModel) -> Skin:
    """Its skin."""
    return make_skin(hand)


def zero_poses(skin: Skin) -> np.ndarray:
    """The links of the zero pose."""
    poses = np.zeros((LINK_COUNT, 7))
    poses[:, :3], poses[:, 6] = skin.link_origin, 1.0
    return poses


def mesh(surface: Surface) -> trimesh.Trimesh:
    """The surface, its vertices as they are."""
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def test_skin_is_one_surface_over_the_links(hand: HandModel, skin: Skin) -> None:
    """It has one piece, its normals point outwards, and it is nowhere far from the shapes that collide."""
    surface = skin.posed(zero_poses(skin))
    whole = mesh(surface)
    assert whole.body_count == 1
    assert 1.5e-4 < whole.volume < 6e-4
    assert (np.einsum("fij,fj->fi", surface.corner_normals, whole.face_normals).mean(axis=1) > 0.5).mean() > 0.99
    links = hand_surface(hand, rigid=True).posed(zero_poses(skin))
    points = trimesh.sample.sample_surface(mesh(links), 40_000, seed=0)[0]
    distance, _ = cKDTree(points).query(surface.vertices)
    assert np.percentile(distance, 95) < BLEND / 2 + CELL and distance.max() < 2 * BLEND


def test_skin_follows_its_links(skin: Skin) -> None:
    """Moved as a whole it keeps its shape; when one finger's end bends, only the skin around there does."""
    poses = zero_poses(skin)
    np.testing.assert_allclose(skin.posed(poses).vertices, skin.vertices, atol=1e-12)
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1, atol=1e-12)
    turn = trimesh.transformations.rotation_matrix(1.0, [1, 2, 3])[:3, :3]
    moved = poses.copy()
    moved[:, :3] = poses[:, :3] @ turn.T + [1, 2, 3]
    moved[:, 3:] = np.roll(trimesh.transformations.quaternion_about_axis(1.0, [1, 2, 3]), -1)
    np.testing.assert_allclose(skin.posed(moved).vertices, skin.vertices @ turn.T + [1, 2, 3], atol=1e-9)
    bent, tip = poses.copy(), LINKS.index("middle3")
    bent[tip, 3:] = [0, 0, np.sin(0.5), np.cos(0.5)]
    change = np.linalg.norm(skin.posed(bent).vertices - skin.vertices, axis=1)
    assert change.max() > 0.01
    assert change[skin.weights[:, tip] == 0].max() < 1e-12


@pytest.mark.parametrize("rigid", [True, False])
def test_faces_take_what_their_link_has(hand: HandModel, rigid: bool) -> None:
    """A number that each link has comes out at the faces around that link, and nothing beyond the range of links."""
    surface = hand_surface(hand, rigid=rigid)
    poses = zero_poses(make_skin(hand))
    found = surface.of_faces(np.arange(LINK_COUNT, dtype=float))
    posed = surface.posed(poses)
    assert found.shape == (len(posed.faces),) and found.min() >= 0 and found.max() <= LINK_COUNT - 1
    index_tip = poses[LINKS.index("index3"), :3] + hand.tip_offset[1]
    nearest = np.linalg.norm(posed.vertices[posed.faces].mean(axis=1) - index_tip, axis=1).argmin()
    assert found[nearest] == pytest.approx(LINKS.index("index3"), abs=0.2)


def test_left_is_the_mirror_image(hand: HandModel, skin: Skin) -> None:
    """The skin of the mirrored hand is the mirrored skin, as far as the cells allow."""
    other = make_skin(mirror(hand, hand.path))
    distance, _ = cKDTree(other.vertices * [-1, 1, 1]).query(skin.vertices)
    assert np.percentile(distance, 99) < 1.5 * CELL
    assert mesh(other.posed(zero_poses(other))).volume > 0
