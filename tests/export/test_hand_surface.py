"""Tests of how hands look: skin and links are where kinematics have the hand."""

import dataclasses

import numpy as np
import pytest
import trimesh

from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.skin_drawing import draw_skin
from artigrasp.export.hand_surface import Skin, hand_surface, skin_of
from artigrasp.kernels.layout import LINK_COUNT, LINKS


@pytest.fixture(scope="module")
def hand() -> HandModel:
    """The open right hand."""
    return load_hand("open", "right")


def zero_poses(hand: HandModel) -> np.ndarray:
    """The links of the zero pose."""
    poses = np.zeros((LINK_COUNT, 7))
    poses[:, :3], poses[:, 6] = skin_of(hand).link_origin, 1.0
    return poses


@pytest.mark.parametrize("rigid", [True, False])
def test_surface_is_closed_and_its_normals_point_outwards(hand: HandModel, rigid: bool) -> None:
    """The skin is one piece; its refinement keeps what it encloses to a few per cent."""
    surface = hand_surface(hand, rigid=rigid).posed(zero_poses(hand))
    whole = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert whole.is_watertight and whole.volume > 1e-4
    assert (np.einsum("fij,fj->fi", surface.corner_normals, whole.face_normals).mean(axis=1) > 0.5).mean() > 0.99
    if not rigid:
        skin = skin_of(hand)
        coarse = trimesh.Trimesh(skin.vertices, skin.faces, process=False)
        assert whole.body_count == 1 and len(whole.faces) == 4 * len(coarse.faces)
        assert whole.volume == pytest.approx(coarse.volume, rel=0.04)


def test_surface_follows_its_links(hand: HandModel) -> None:
    """When one finger's end bends, only the skin around there does."""
    surface = hand_surface(hand)
    poses = zero_poses(hand)
    bent, tip = poses.copy(), LINKS.index("middle3")
    bent[tip, 3:] = [0, 0, np.sin(0.5), np.cos(0.5)]
    straight = surface.posed(poses)
    change = np.linalg.norm(surface.posed(bent).vertices - straight.vertices, axis=1)
    assert change.max() > 0.01
    far = np.linalg.norm(straight.vertices - poses[tip, :3], axis=1) > 0.04
    assert change[far].max() < 1e-9


def test_a_hand_without_a_skin_gets_one(hand: HandModel) -> None:
    """It is drawn, as it would be in a file."""
    bare = dataclasses.replace(hand, skin=None)
    surface = hand_surface(bare)
    assert isinstance(surface, Skin)
    np.testing.assert_array_equal(surface.skin.faces, draw_skin(bare).faces)


@pytest.mark.parametrize("rigid", [True, False])
def test_faces_take_what_their_link_has(hand: HandModel, rigid: bool) -> None:
    """A number that each link has comes out at the faces around that link, and nothing beyond the range of links."""
    surface = hand_surface(hand, rigid=rigid)
    poses = zero_poses(hand)
    found = surface.of_faces(np.arange(LINK_COUNT, dtype=float))
    posed = surface.posed(poses)
    assert found.shape == (len(posed.faces),) and found.min() >= 0 and found.max() <= LINK_COUNT - 1
    index_tip = poses[LINKS.index("index3"), :3] + hand.tip_offset[1]
    nearest = np.linalg.norm(posed.vertices[posed.faces].mean(axis=1) - index_tip, axis=1).argmin()
    assert found[nearest] == pytest.approx(LINKS.index("index3"), abs=0.2)
