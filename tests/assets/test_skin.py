"""Tests of the hands' skin: closed, bound to the links, and where the hand is."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdSkel, UsdValidation
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import HandModel, load_hand, mirror, read_hand, write_hand
from artigrasp.assets.hand_skin import HandSkin
from artigrasp.assets.hand_surface import HandPoints, core_points
from artigrasp.assets.skin_drawing import draw_skin
from artigrasp.assets.skin_usd import INFLUENCES
from artigrasp.errors import UserError
from artigrasp.kernels.layout import LINK_COUNT, LINK_PARENTS, LINKS


@pytest.fixture(scope="module")
def hand() -> HandModel:
    """The open right hand."""
    return load_hand("open", "right")


@pytest.fixture(scope="module")
def skin(hand: HandModel) -> HandSkin:
    """Its skin, as it is stored."""
    assert hand.skin is not None
    return hand.skin


def link_poses(hand: HandModel, flexion: dict[str, float]) -> np.ndarray:
    """Where the links are when some of them are flexed by so much [rad]."""
    poses = np.zeros((LINK_COUNT, 7))
    turns = [Rotation.identity()]
    poses[0, 6] = 1
    for link in range(1, LINK_COUNT):
        parent = LINK_PARENTS[link]
        turns.append(turns[parent] * Rotation.from_rotvec([0, 0, flexion.get(LINKS[link], 0.0)]))
        poses[link, :3] = poses[parent, :3] + turns[parent].apply(hand.link_offset[link])
        poses[link, 3:] = turns[link].as_quat()
    return poses


def fist(hand: HandModel) -> np.ndarray:
    """Four fingers as far as they go."""
    joints = {1: 1.45, 2: 1.65, 3: 1.0}
    return link_poses(
        hand,
        {
            f"{finger}{joint}": angle
            for finger in ("index", "middle", "ring", "pinky")
            for joint, angle in joints.items()
        },
    )


def check_closed(skin: HandSkin) -> trimesh.Trimesh:
    """It is one closed surface, without handles, whose outside is outside."""
    mesh = trimesh.Trimesh(skin.vertices, skin.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.body_count == 1 and mesh.euler_number == 2
    assert 2e-4 < mesh.volume < 6e-4
    return mesh


def test_skin_is_closed_and_bound(skin: HandSkin) -> None:
    """It has no gap, and each vertex follows a few links by weights that add up to one."""
    mesh = check_closed(skin)
    assert 640 <= len(skin.vertices) <= 2000
    assert np.degrees(mesh.face_angles.min()) > 3
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1, atol=1e-12)
    assert skin.weights.min() >= 0 and (skin.weights > 0).sum(axis=1).max() <= INFLUENCES
    assert (skin.colours >= 0).all() and (skin.colours <= 1).all()


def points_around(balls: HandPoints) -> HandPoints:
    """Points all over the surfaces of balls."""
    directions = trimesh.creation.icosphere(subdivisions=1).vertices
    count = len(directions)
    position = np.repeat(balls.position, count, axis=0)
    position += np.repeat(balls.radius, count)[:, None] * np.tile(directions, (len(balls.link), 1))
    return HandPoints(np.repeat(balls.link, count), position, np.zeros(len(position)))


def test_zero_pose_is_the_bind_pose(hand: HandModel, skin: HandSkin) -> None:
    """There nothing is bent, and moved as a whole the skin keeps its shape."""
    poses = link_poses(hand, {})
    np.testing.assert_allclose(skin.link_origin, poses[:, :3], atol=1e-7)
    np.testing.assert_allclose(skin.posed(poses), skin.vertices, atol=1e-7)
    turn, shift = Rotation.from_rotvec([0.3, -1.0, 0.5]), np.array([1.0, 2.0, 3.0])
    moved = np.concatenate([turn.apply(poses[:, :3]) + shift, np.tile(turn.as_quat(), (LINK_COUNT, 1))], axis=1)
    both = skin.posed(np.stack([poses, moved]))
    np.testing.assert_allclose(both[1], turn.apply(skin.vertices) + shift, atol=1e-6)


def test_skin_is_where_the_hand_collides(hand: HandModel, skin: HandSkin) -> None:
    """What can touch is near the skin: fingers beyond the webs to 3 mm, a palm that is no box to 20 mm."""
    core = core_points(hand)
    points = points_around(core)
    places, centres = (each.position + skin.link_origin[each.link] for each in (points, core))
    depth = core.radius - np.linalg.norm(places[:, None] - centres, axis=2)
    exposed = depth.max(axis=1) < 1e-4
    surface = trimesh.Trimesh(skin.vertices, skin.faces, process=False)
    samples = trimesh.sample.sample_surface(surface, 60_000, seed=0)[0]
    distance = cKDTree(samples).query(places[exposed])[0]
    beyond_webs = (points.link[exposed] > 0) & (points.link[exposed] % 3 != 1)
    assert np.percentile(distance[beyond_webs], 99) < 0.003
    assert distance.max() < 0.02


def test_nothing_flies_in_a_fist(hand: HandModel, skin: HandSkin) -> None:
    """Every vertex stays about as far from the link that holds it most, and no triangle becomes a needle."""
    posed = skin.posed(fist(hand))
    turns = Rotation.from_quat(fist(hand)[:, 3:])
    holder = skin.weights.argmax(axis=1)
    local = turns[holder].inv().apply(posed - fist(hand)[holder, :3])
    assert np.linalg.norm(local - (skin.vertices - skin.link_origin[holder]), axis=1).max() < 0.012
    before, after = (
        vertices[skin.faces] - vertices[np.roll(skin.faces, 1, axis=1)] for vertices in (skin.vertices, posed)
    )
    stretch = np.linalg.norm(after, axis=2) / np.linalg.norm(before, axis=2)
    assert stretch.max() < 4 and np.percentile(stretch, 99) < 2.2
    volume = trimesh.Trimesh(posed, skin.faces, process=False).volume
    assert volume == pytest.approx(trimesh.Trimesh(skin.vertices, skin.faces, process=False).volume, rel=0.1)


def test_only_the_skin_around_a_joint_moves(hand: HandModel, skin: HandSkin) -> None:
    """The end of a finger bends alone."""
    change = np.linalg.norm(skin.posed(link_poses(hand, {"middle3": 1.0})) - skin.vertices, axis=1)
    assert change.max() > 0.01
    assert change[skin.weights[:, LINKS.index("middle3")] == 0].max() < 1e-6


def test_left_is_the_exact_mirror_image(skin: HandSkin) -> None:
    """Of the shipped hands, vertex by vertex."""
    left = load_hand("open", "left").skin
    assert left is not None
    np.testing.assert_array_equal(left.vertices * [-1, 1, 1], skin.vertices)
    np.testing.assert_array_equal(left.weights, skin.weights)
    check_closed(left)


def test_a_skin_is_drawn_for_any_hand(hand: HandModel) -> None:
    """A hand with other proportions, and of the other side, gets a closed skin too."""
    larger = dataclasses.replace(
        mirror(hand, hand.path),
        skin=None,
        link_offset=mirror(hand, hand.path).link_offset * 1.1,
        tip_offset=mirror(hand, hand.path).tip_offset * 1.1,
    )
    drawn = draw_skin(larger)
    check_closed(drawn)
    middle = LINKS.index("middle3")
    assert np.linalg.norm(drawn.vertices - drawn.link_origin[middle], axis=1).min() < 0.012


def test_file_keeps_the_skin(hand: HandModel, skin: HandSkin, tmp_path: Path) -> None:
    """Written and read again it is the same to a micrometre, and USD finds it valid and skins it alike."""
    path = tmp_path / "hand.usda"
    write_hand(dataclasses.replace(hand, path=path))
    again = read_hand(path).skin
    assert again is not None
    np.testing.assert_allclose(again.vertices, skin.vertices, atol=1e-6)
    np.testing.assert_allclose(again.weights, skin.weights, atol=1e-6)
    np.testing.assert_array_equal(again.faces, skin.faces)
    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert not [
        error.GetMessage() for error in errors if str(error.GetSites()[0].GetPrim().GetPath()).startswith("/Hand/skin")
    ]
    assert UsdSkel.BindingAPI(stage.GetPrimAtPath("/Hand/skin/surface")).GetSkeleton()
    write_hand(dataclasses.replace(hand, path=path, skin=None))
    assert read_hand(path).skin is None


def test_a_malformed_skin_is_refused(hand: HandModel, tmp_path: Path) -> None:
    """The line says which number is out of place."""
    path = tmp_path / "hand.usda"
    write_hand(dataclasses.replace(hand, path=path))
    stage = Usd.Stage.Open(str(path))
    indices = stage.GetAttributeAtPath("/Hand/skin/surface.primvars:skel:jointIndices")
    indices.Set([16, *list(indices.Get())[1:]])
    stage.GetRootLayer().Save()
    with pytest.raises(UserError, match="jointIndices: expected 0 to 15, found 0 to 16"):
        read_hand(path)
