"""Objects: what is shipped, what a file keeps, what Newton makes of it."""

import importlib.util
import re
from dataclasses import fields
from pathlib import Path

import newton
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artigrasp.assets.object import ObjectModel, PartModel, load_object, read_object, write_object
from artigrasp.errors import UserError


def assert_same(model: ObjectModel, other: ObjectModel) -> None:
    """Two objects agree in everything but their path."""
    for one, two in ((model, other), *zip(model.parts, other.parts, strict=True)):
        for field in fields(one):
            if field.name not in ("name", "path", "parts", "pieces"):
                np.testing.assert_allclose(
                    getattr(one, field.name), getattr(two, field.name), rtol=1e-6, atol=1e-7, err_msg=field.name
                )
    for part, other_part in zip(model.parts, other.parts, strict=True):
        for piece, other_piece in zip(part.pieces, other_part.pieces, strict=True):
            np.testing.assert_allclose(piece.vertices, other_piece.vertices, atol=1e-7)
            np.testing.assert_array_equal(piece.faces, other_piece.faces)


def test_shipped_box_is_what_its_program_writes(tmp_path: Path) -> None:
    """``tools/author_open_box.py`` writes the shipped file, and the file keeps every number."""
    path = Path(__file__).parents[2] / "tools" / "author_open_box.py"
    spec = importlib.util.spec_from_file_location("author_open_box", path)
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    box = program.lidded_box(tmp_path)
    write_object(box)
    shipped = load_object("lidded-box")
    assert box.path.read_text() == shipped.path.read_text()
    assert_same(box, shipped)


def test_points_beyond_any_object_are_refused(tmp_path: Path) -> None:
    """What is measured of them would be no number, or take all memory."""
    text = load_object("lidded-box").path.read_text()
    point = re.search(r"points = \[\((\S+),", text)
    assert point is not None
    (tmp_path / "o.usda").write_text(text[: point.start(1)] + "1e29" + text[point.end(1) :])
    with pytest.raises(UserError, match=r"points: expected points within 10000 m, found some beyond"):
        read_object(tmp_path / "o.usda")


def test_box_stands_on_the_floor_and_opens_upwards() -> None:
    """The box has its stated size, and opening lifts the lip that fingers take hold of."""
    box = load_object("lidded-box")
    vertices = box.vertices_in_base(0.0)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.256, 0.2, 0.14], atol=1e-6)
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    lip = box.parts[1].vertices[box.parts[1].vertices[:, 1].argmin()]
    position, orientation = box.articulated_pose_in_base(0.5)
    opened = Rotation.from_quat(orientation).apply(lip) + position
    assert opened[2] - lip[2] > 0.08
    assert lip[1] == pytest.approx(box.parts[0].vertices[:, 1].min() - 0.02)


def test_box_weighs_what_its_boards_weigh() -> None:
    """Centre of mass and inertia are those of boards of one density."""
    base = load_object("lidded-box").parts[0]
    boards = [trimesh.Trimesh(piece.vertices, piece.faces) for piece in base.pieces]
    volumes = np.array([board.volume for board in boards])
    centres = np.array([board.center_mass for board in boards])
    np.testing.assert_allclose(base.com, volumes @ centres / volumes.sum(), atol=1e-6)
    inertia = np.zeros((3, 3))
    for board, mass in zip(boards, base.mass * volumes / volumes.sum(), strict=True):
        offset = board.center_mass - base.com
        inertia += board.moment_inertia * mass / board.volume
        inertia += mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    np.testing.assert_allclose(base.inertia, inertia, rtol=1e-4, atol=1e-8)


@pytest.mark.parametrize("floating", [False, True])
def test_newton_imports_the_object(floating: bool) -> None:
    """Newton's importer makes two bodies of it, a hinge with our limits and damping, and the base fixed or free."""
    box = load_object("lidded-box")
    builder = newton.ModelBuilder()
    builder.add_usd(str(box.path), floating=floating, load_visual_shapes=False)
    root = newton.JointType.FREE if floating else newton.JointType.FIXED
    assert builder.joint_type == [root, newton.JointType.REVOLUTE]
    assert builder.body_label == ["/Object/base", "/Object/articulated"]
    assert set(builder.shape_type) == {newton.GeoType.CONVEX_MESH}
    assert len(builder.shape_type) == sum(len(part.pieces) for part in box.parts)
    assert builder.joint_limit_lower[-1] == pytest.approx(box.hinge_lower, abs=1e-6)
    assert builder.joint_limit_upper[-1] == pytest.approx(box.hinge_upper, abs=1e-6)
    assert builder.joint_damping[-1] == pytest.approx(box.hinge_damping, rel=1e-6)
    assert builder.joint_friction[-1] == pytest.approx(box.hinge_friction)
    np.testing.assert_allclose(builder.body_mass, [part.mass for part in box.parts], rtol=1e-6)
    np.testing.assert_allclose(builder.body_com, [part.com for part in box.parts], atol=1e-6)
    np.testing.assert_allclose(
        np.reshape(builder.body_inertia, (-1, 3, 3)), [part.inertia for part in box.parts], atol=1e-8
    )


def test_hinge_axis_survives_every_direction(tmp_path: Path) -> None:
    """The joint's frame is turned so that its z axis is the hinge, whichever way that points."""
    box = load_object("lidded-box")
    directions = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], *np.random.default_rng(0).normal(size=(5, 3))]
    for index, direction in enumerate(directions):
        axis = np.array(direction, float) / np.linalg.norm(direction)
        values = {field.name: getattr(box, field.name) for field in fields(box)}
        model = ObjectModel(**(values | {"hinge_axis": axis, "path": tmp_path / f"{index}.usda"}))
        write_object(model)
        np.testing.assert_allclose(read_object(model.path).hinge_axis, axis, atol=1e-6)


def test_file_that_is_no_object_is_named(tmp_path: Path) -> None:
    """Malformed files each give one line that names the file and the trouble."""
    text = load_object("lidded-box").path.read_text()
    cases = {
        "hand": (load_object("lidded-box").path.parents[1] / "hands" / "open_left.usda").read_text(),
        "no_hinge": text.replace('"hinge"', '"axle"'),
        "no_mass": text.replace('"PhysicsRigidBodyAPI", "PhysicsMassAPI"', '"PhysicsRigidBodyAPI"'),
        "axes": text.replace("principalAxes = (", "principalAxes = (9", 1),
        "quads": text.replace("faceVertexCounts = [3, 3", "faceVertexCounts = [4, 2", 1),
        "indices": text.replace("faceVertexIndices = [", "faceVertexIndices = [99, ", 1),
    }
    messages = {
        "hand": "format: expected 'artigrasp.object', found 'artigrasp.hand'",
        "no_hinge": "/Object/hinge: expected a prim",
        "no_mass": "expected a PhysicsMassAPI",
        "axes": "principalAxes: expected a unit quaternion",
        "quads": "expected triangles only",
        "indices": "faceVertexIndices: expected",
    }
    for name, content in cases.items():
        assert content != text
        path = tmp_path / f"{name}.usda"
        path.write_text(content)
        with pytest.raises(UserError, match=r"^[^\n]*$") as caught:
            read_object(path)
        assert str(path) in str(caught.value) and messages[name] in str(caught.value)


def test_unknown_object_suggests_a_name() -> None:
    """A misspelt object is answered with the nearest one."""
    with pytest.raises(UserError, match="did you mean 'lidded-box'"):
        load_object("lided-box")


def test_part_is_described_in_the_object_frame() -> None:
    """Visual mesh and pieces of a part cover the same space."""
    parts: tuple[PartModel, ...] = load_object("lidded-box").parts
    for part in parts:
        corners = np.concatenate([piece.vertices for piece in part.pieces])
        np.testing.assert_allclose(corners.min(axis=0), part.vertices.min(axis=0), atol=1e-6)
        np.testing.assert_allclose(corners.max(axis=0), part.vertices.max(axis=0), atol=1e-6)
