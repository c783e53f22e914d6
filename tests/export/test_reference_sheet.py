"""Tests of contact sheets of references: who is shown, where, from which side, and what is refused."""

import dataclasses
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.export.camera import unit_vector
from artigrasp.export.reference_sheet import CONTACT, GAP, LABEL_SHARE, ReferencePictures, label, render_references
from artigrasp.export.surface import join, mesh_surface
from artigrasp.export.viewpoint import telling_directions
from artigrasp.kernels.layout import ARTICULATED, HANDS, LINK_COUNT
from artigrasp.motion.kinematics import posed_references
from artigrasp.references.reference import ReferenceSet
from tests.example_references import RIGHT, box_references


def reddish(image: np.ndarray) -> np.ndarray:
    """Where an image has the colour of links that should touch."""
    red, green, blue = np.moveaxis(image.astype(int), -1, 0)
    return (red > 2.2 * green) & (red > 2.2 * blue) & (red > 100)


def moved(references: ReferenceSet) -> ReferenceSet:
    """The same references on an object that stands elsewhere, turned, with its lid open."""
    turn = Rotation.from_euler("z", 70, degrees=True).as_quat()
    pose = np.tile([0.4, -0.2, 0.0, *turn], (len(references), 1))
    return dataclasses.replace(references, object_pose=pose, object_angle=np.full(len(references), 0.8))


def test_hands_are_posed_relative_to_their_part() -> None:
    """The wrists in the world are base times hinge times wrist in part, and the base is where the reference has it."""
    references = moved(box_references())
    object = load_object("lidded-box")
    links, parts = posed_references(references, [load_hand("open", side) for side in HANDS], object)
    assert links.shape == (3, 2, LINK_COUNT, 7) and parts.shape == (3, 2, 7)
    np.testing.assert_allclose(parts[:, 0], references.object_pose, atol=1e-6)
    position, orientation = object.articulated_pose_in_base(0.8)
    for row in range(3):
        base_turn = Rotation.from_quat(references.object_pose[row, 3:])
        part_turn = base_turn * Rotation.from_quat(orientation)
        part_position = base_turn.apply(position) + references.object_pose[row, :3]
        wrist = references.wrist_pose_in_part[row, RIGHT]
        np.testing.assert_allclose(links[row, RIGHT, 0, :3], part_turn.apply(wrist[:3]) + part_position, atol=1e-6)
        found = Rotation.from_quat(links[row, RIGHT, 0, 3:])
        assert (found.inv() * part_turn * Rotation.from_quat(wrist[3:])).magnitude() < 1e-5


def test_only_hands_that_take_part_are_shown() -> None:
    """With both hands active there is a hand's surface more, links that should touch are red, and nothing is buried."""
    references = box_references()
    both = dataclasses.replace(references, active=np.ones((3, 2), bool))
    one, two = (ReferencePictures(each, size=32, views=1, links=True).scene(0) for each in (references, both))
    assert len(two[0].faces) > len(one[0].faces) + 1000
    assert one[0].vertices[:, 2].min() == pytest.approx(0, abs=1e-9)
    is_red = (one[1] == CONTACT).all(axis=1)
    assert 0 < is_red.sum() < 0.5 * len(is_red)
    skinned = [ReferencePictures(references, size=32, views=1).scene(row)[1] for row in (0, 1)]
    assert [np.isclose(colours, CONTACT, atol=0.05).all(axis=1).any() for colours in skinned] == [True, False]


def test_pictures_show_the_contacts() -> None:
    """The pictures of a reference with contacts show red links, though those are below the lid, of one without none."""
    pictures = ReferencePictures(moved(box_references()), size=160, views=2, links=True)
    image = pictures.render(0)
    assert image.shape == (160, 320, 3)
    assert reddish(image).sum() > 4
    assert reddish(pictures.render(1)).sum() == 0


def test_a_view_is_not_behind_a_wall() -> None:
    """What matters is looked at from the side on which no wall hides it; the second view is from elsewhere."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    wall = trimesh.creation.box((0.02, 2.0, 2.0))
    ball.apply_translation((0.2, 0, 0.3))
    surfaces = [mesh_surface(mesh.vertices, mesh.faces) for mesh in (ball, wall)]
    weights = np.repeat([1.0, 0.0], [len(surface.faces) for surface in surfaces])
    first, second = (unit_vector(direction) for direction in telling_directions(join(surfaces), weights, 2))
    assert first[0] > -1e-6 and second[0] > -1e-6
    turn = np.angle(complex(*second[:2]) / complex(*first[:2]))
    assert abs(turn) > np.radians(59)


def test_a_sheet_has_its_size(tmp_path: Path) -> None:
    """A header, and a cell for each reference with its pictures and its label, in rows."""
    seen: list[tuple[int, int]] = []
    references = box_references()
    render_references(
        [references, references.select(indices=[2])],
        tmp_path / "sheet.png",
        size=50,
        columns=3,
        links=True,
        progress=lambda *counts: seen.append(counts),
    )
    label_height = round(LABEL_SHARE * 50)
    image = imageio.imread(tmp_path / "sheet.png")
    assert image.shape == (label_height + 2 * (50 + label_height + GAP), 3 * (100 + GAP), 3)
    assert seen == [(k, 4) for k in range(1, 5)]
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


def test_labels_tell_references_apart() -> None:
    """Whatever tells two references apart changes the words below them; a lack of contacts is told in red."""
    references = box_references()
    recorded = dataclasses.replace(references, subject=np.array(["s5"] * 3), sequence=np.array(["a_use_01"] * 3))
    images = [
        label(references, 0, 0, 200, 40),
        label(references, 0, 1, 200, 40),
        label(references, 0, 0, 200, 40, with_object=True),
        label(references, 1, 0, 200, 40),
        label(recorded, 0, 0, 200, 40),
        label(dataclasses.replace(references, active=np.ones((3, 2), bool)), 0, 0, 200, 40),
        label(dataclasses.replace(references, object_angle=np.full(3, 0.8)), 0, 0, 200, 40),
        label(dataclasses.replace(references, kind=np.array(["grasp"] * 3)), 0, 0, 200, 40),
    ]
    assert all((a != b).any() for k, a in enumerate(images) for b in images[:k])
    assert reddish(images[3]).any() and not reddish(images[0]).any()


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("a.gif", {}, "expected a name that ends in .png or .jpg or .webp"),
        ("a.png", {"size": 5}, "size: expected 32 to 2000, found 5"),
        ("a.png", {"views": 3}, "views: expected 1 to 2, found 3"),
        ("a.png", {"columns": 0}, "columns: expected 1 to 1000, found 0"),
    ],
)
def test_sheets_that_cannot_be(name: str, changes: dict[str, int], message: str, tmp_path: Path) -> None:
    """A suffix, a size or a number that cannot be is the user's mistake, and nothing is written."""
    with pytest.raises(UserError, match=message):
        render_references([box_references()], tmp_path / name, **changes)
    assert list(tmp_path.iterdir()) == []


def test_example_references_are_on_the_lid() -> None:
    """What the other tests take for granted: the right hand of the example belongs to the articulated part."""
    assert (box_references().part[:, RIGHT] == ARTICULATED).all()
