"""Hands: what is shipped, what a file keeps, what Newton makes of it."""

import importlib.util
from dataclasses import fields
from pathlib import Path

import newton
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import HandModel, load_hand, mirror, read_hand, write_hand
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT, LINK_PARENTS, LINKS, TIP_LINKS

SIDES = ("left", "right")
NUMBERS = [field.name for field in fields(HandModel) if field.name not in ("name", "side", "path", "colliders", "skin")]


def assert_same(hand: HandModel, other: HandModel, tolerance: float = 1e-7) -> None:
    """Two hands agree in every number."""
    for name in NUMBERS:
        np.testing.assert_allclose(getattr(hand, name), getattr(other, name), atol=tolerance, err_msg=name)
    for link, other_link in zip(hand.colliders, other.colliders, strict=True):
        for collider, other_collider in zip(link, other_link, strict=True):
            assert type(collider) is type(other_collider)
            for field in fields(collider):
                np.testing.assert_allclose(
                    getattr(collider, field.name), getattr(other_collider, field.name), atol=tolerance
                )


def keypoints(hand: HandModel, angles: np.ndarray) -> np.ndarray:
    """Link origins, then fingertips, in the wrist frame for finger angles of shape (15, 3)."""
    position, turn = np.zeros((LINK_COUNT, 3)), [Rotation.identity()] * LINK_COUNT
    for link in range(1, LINK_COUNT):
        parent = LINK_PARENTS[link]
        position[link] = position[parent] + turn[parent].apply(hand.link_offset[link])
        turn[link] = turn[parent] * Rotation.from_euler("XYZ", angles[link - 1])
    tips = [position[link] + turn[link].apply(tip) for link, tip in zip(TIP_LINKS, hand.tip_offset, strict=True)]
    return np.concatenate([position, tips])


@pytest.mark.parametrize("side", SIDES)
def test_open_hand_has_human_proportions(side: str) -> None:
    """The shipped hand weighs 0.4 kg, is about 0.18 m long and has a place for every limit and shape."""
    hand = load_hand("open", side)
    assert (hand.name, hand.side) == ("open", side)
    assert hand.link_mass.sum() == pytest.approx(0.4, abs=1e-6)
    middle_tip = keypoints(hand, np.zeros((15, 3)))[LINK_COUNT + 2]
    assert np.linalg.norm(middle_tip) == pytest.approx(0.182, abs=2e-3)
    assert (hand.lower < hand.upper).all() and (hand.lower <= 0).all() and (hand.upper >= 0).all()
    assert [len(link) for link in hand.colliders] == [2] + [1] * 15


@pytest.mark.parametrize("side", SIDES)
def test_fist_curls_to_the_palm(side: str) -> None:
    """Flexing every finger joint by 1.2 rad brings the fingertips to the palm side, -y, of both hands."""
    hand = load_hand("open", side)
    sign = 1.0 if side == "right" else -1.0
    angles = np.zeros((15, 3))
    open_tips = keypoints(hand, angles)[-4:]
    angles[:12, 2] = 1.2 * sign
    fist_tips = keypoints(hand, angles)[-4:]
    assert (open_tips[:, 0] * sign < -0.13).all()
    assert (fist_tips[:, 1] < -0.03).all()
    assert (fist_tips[:, 0] * sign > -0.08).all()
    flexion = slice(8, 42, 3)
    assert ((hand.upper if side == "right" else -hand.lower)[flexion] > 1.2).all()


def test_left_is_the_mirror_of_right() -> None:
    """The left open hand mirrors the right one exactly, mirroring twice changes nothing, and poses mirror too."""
    left, right = load_hand("open", "left"), load_hand("open", "right")
    assert_same(left, mirror(right, left.path))
    assert_same(right, mirror(mirror(right, left.path), right.path), tolerance=0.0)
    angles = np.random.default_rng(0).uniform(-1, 1, (15, 3))
    mirrored = keypoints(left, angles * [1, -1, -1]) * [-1, 1, 1]
    np.testing.assert_allclose(mirrored, keypoints(right, angles), atol=1e-9)


def test_shipped_hands_are_what_their_program_writes(tmp_path: Path) -> None:
    """``tools/author_open_hand.py`` writes the shipped files."""
    path = Path(__file__).parents[2] / "tools" / "author_open_hand.py"
    spec = importlib.util.spec_from_file_location("author_open_hand", path)
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    right, shipped = program.open_hand(tmp_path), load_hand("open", "right")
    write_hand(right)
    written = read_hand(right.path)
    assert_same(right, written)
    assert_same(written, shipped, tolerance=0.0)
    # The triangles of a skin are the choice of a program of others, which may choose otherwise elsewhere.
    assert written.skin is not None and shipped.skin is not None
    assert cKDTree(shipped.skin.vertices).query(written.skin.vertices)[0].max() < 0.01


@pytest.mark.parametrize("side", SIDES)
def test_newton_imports_the_hand(side: str) -> None:
    """Newton's importer makes a fixed base, 16 links and 51 DOFs of it, with our limits, efforts and masses."""
    hand = load_hand("open", side)
    builder = newton.ModelBuilder()
    builder.add_usd(str(hand.path))
    assert builder.body_label == ["/Hand/base", *(f"/Hand/{link}" for link in LINKS)]
    assert builder.joint_type[0] == newton.JointType.FIXED
    assert builder.joint_type[1:] == [newton.JointType.D6] * LINK_COUNT
    assert len(builder.joint_qd) == DOF_COUNT
    np.testing.assert_allclose(builder.joint_limit_lower, hand.lower, atol=1e-6)
    np.testing.assert_allclose(builder.joint_limit_upper, hand.upper, atol=1e-6)
    np.testing.assert_allclose(builder.joint_effort_limit, hand.effort)
    np.testing.assert_allclose(builder.body_mass[1:], hand.link_mass, rtol=1e-6)
    np.testing.assert_allclose(builder.body_com[1:], hand.link_com, atol=1e-8)
    np.testing.assert_allclose(np.reshape(builder.body_inertia[1:], (-1, 3, 3)), hand.link_inertia, atol=1e-10)
    fingers = slice(6, DOF_COUNT)
    np.testing.assert_allclose(builder.joint_damping[fingers], hand.damping[fingers], rtol=1e-6)
    np.testing.assert_allclose(builder.joint_armature[fingers], hand.armature[fingers], rtol=1e-6)
    shapes = [newton.GeoType.BOX, newton.GeoType.CAPSULE]
    assert sum(shape in shapes for shape in builder.shape_type) == 17


def test_file_that_is_no_hand_is_named(tmp_path: Path) -> None:
    """Missing, malformed and incomplete files each give one line that names the file and the trouble."""
    text = load_hand("open", "right").path.read_text()
    cases = {
        "missing": (None, "found nothing"),
        "garbage": ("not usd at all", "cannot read this as USD"),
        "foreign": ('#usda 1.0\ndef Xform "Hand" {}\n', "format: expected 'artigrasp.hand', found none"),
        "newer": (text.replace("int version = 2", "int version = 3"), "version: expected at most 2, found 3"),
        "no_thumb": (text.replace('def Xform "thumb3"', 'def Xform "thumb4"'), "/Hand/thumb3: expected a prim"),
        "no_side": (text.replace('artigrasp:side = "right"', 'artigrasp:side = "top"'), "artigrasp:side"),
        "no_place": (text.replace("xformOp:translate = (-0.047", "elsewhere = (-0.047"), "expected a transformation"),
        "nowhere": (
            text.replace("xformOp:translate = (-0.047,", "xformOp:translate = (nan,"),
            "found operations without",
        ),
        "nan": (text.replace("physics:high = 100", "physics:high = nan"), "expected finite numbers, found nan"),
    }
    for name, (content, message) in cases.items():
        path = tmp_path / f"{name}.usda"
        if content is not None:
            assert content != text
            path.write_text(content)
        with pytest.raises(UserError, match=r"^[^\n]*$") as caught:
            read_hand(path)
        assert str(path) in str(caught.value) and message in str(caught.value)


def test_unknown_hand_suggests_a_name() -> None:
    """A misspelt hand is answered with the nearest one."""
    with pytest.raises(UserError, match="did you mean 'open_right'"):
        load_hand("opne", "right")
