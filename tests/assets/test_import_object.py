"""Other people's hinged objects, in URDF and USD, become ours."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics

from artigrasp.assets.check import check_asset
from artigrasp.assets.imported_object import make_imported
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import ObjectModel, load_object, read_object, write_object
from artigrasp.assets.urdf_object import read_urdf_object
from artigrasp.assets.usd_object import read_usd_object
from artigrasp.errors import UserError

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></visual></link>"""
HINGE = """<joint name="hinge" type="{type}"><parent link="case"/><child link="lid"/>
<origin xyz="0 .1 .1" rpy="0 0 1.5707963267948966"/><axis xyz="{axis}"/>
<limit lower="{lower}" upper="{upper}"/></joint>"""


def urdf(
    folder: Path,
    *,
    axis: str = "0 -2 0",
    lower: float = 0.0,
    upper: float = 2.0,
    more: str = "",
    type: str = "revolute",
) -> Path:
    """A case of 0.3 by 0.2 by 0.1 m under a lid, whose frame is at the hinge, above and behind, and turned by 90°."""
    case = LINK.format(name="case", com="0 0 .04", mass=1.0, at="0 0 .05", size=".3 .2 .1")
    lid = LINK.format(name="lid", com="-.1 0 0", mass=0.2, at="-.1 0 .005", size=".2 .3 .01")
    path = folder / "case.urdf"
    joint = HINGE.format(axis=axis, lower=lower, upper=upper, type=type)
    path.write_text(f'<robot name="case">{case}{lid}{joint}{more}</robot>')
    return path


def imported(path: Path) -> ObjectModel:
    """The object in a file, as ours."""
    return make_imported(read_urdf_object(path), "case", path.with_suffix(".usda"))


def highest(model: ObjectModel, angle: float) -> float:
    """Height of the lid's front edge [m]."""
    return float(model.vertices_in_base(angle)[len(model.parts[0].vertices) :, 2].max())


def test_urdf_keeps_places_masses_and_the_way_it_opens(tmp_path: Path) -> None:
    """In the base's frame at angle 0, every number is the one that the links and the joint say."""
    model = imported(urdf(tmp_path))
    np.testing.assert_allclose(model.hinge_origin, [0, 0.1, 0.1], atol=1e-9)
    np.testing.assert_allclose(model.hinge_axis, [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(np.ptp(model.parts[1].vertices, axis=0), [0.3, 0.2, 0.01], atol=1e-9)
    np.testing.assert_allclose(model.parts[0].com, [0, 0, 0.04], atol=1e-9)
    np.testing.assert_allclose(model.parts[1].com, [0, 0, 0.1], atol=1e-9)
    assert [part.mass for part in model.parts] == pytest.approx([1.0, 0.2])
    assert model.hinge_upper == pytest.approx(2.0)
    write_object(model)
    assert read_object(model.path).name == "case" and check_asset(model.path).usable


def test_closed_is_the_limit_nearer_to_zero(tmp_path: Path) -> None:
    """A joint from -2 to 0 opens the other way; one from 0.5 is closed where it begins."""
    for axis, lower, upper in (("0 2 0", 0.0, 2.0), ("0 -2 0", -2.0, 0.0)):
        model = imported(urdf(tmp_path, axis=axis, lower=lower, upper=upper))
        assert highest(model, 1.5) > highest(model, 0.0) + 0.15
    turned = imported(urdf(tmp_path, axis="0 2 0", lower=0.5, upper=2.0))
    assert turned.hinge_upper == pytest.approx(1.5) and highest(turned, 0.0) == pytest.approx(
        0.1 + 0.2 * np.sin(0.5), abs=0.01
    )


def test_links_that_are_fixed_to_each_other_are_one_part(tmp_path: Path) -> None:
    """A knob on the lid adds its mass, and its shape, to the lid's."""
    knob = LINK.format(name="knob", com="0 0 0", mass=0.1, at="0 0 .02", size=".02 .02 .02")
    joint = '<joint name="glue" type="fixed"><parent link="lid"/><child link="knob"/><origin xyz="-.18 0 0"/></joint>'
    model = imported(urdf(tmp_path, more=knob + joint))
    assert model.parts[1].mass == pytest.approx(0.3) and len(model.parts[1].pieces) == 2
    np.testing.assert_allclose(model.parts[1].com, [0, 0.1 - (0.2 * 0.1 + 0.1 * 0.18) / 0.3, 0.1], atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"type": "fixed"}, "joints: expected one that is not fixed, the hinge, found none"),
        ({"type": "continuous"}, "joint hinge: expected the type revolute, with limits, found 'continuous'"),
        ({"more": '<link name="a"/>'}, "links: expected one that no joint leads to, found case, a"),
        ({"axis": "0 0 0"}, "joint hinge axis: expected a direction, found zeros"),
        (
            {"more": HINGE.format(type="prismatic", axis="1 0 0", lower=0, upper=1)},
            "found hinge .revolute., hinge .pris",
        ),
    ],
)
def test_urdf_that_is_no_hinged_object(changes: dict[str, str], message: str, tmp_path: Path) -> None:
    """One line says what was expected and what was found."""
    with pytest.raises(UserError, match=message):
        read_urdf_object(urdf(tmp_path, **changes))  # type: ignore[arg-type]


def test_missing_mesh_is_named(tmp_path: Path) -> None:
    """A mesh that is not there, or is none, is named."""
    path = urdf(tmp_path)
    path.write_text(path.read_text().replace('<box size=".3 .2 .1"/>', '<mesh filename="package://case/body.obj"/>'))
    with pytest.raises(UserError, match=r"body\.obj: expected a mesh, found nothing"):
        read_urdf_object(path)
    (tmp_path / "body.obj").write_text("hello")
    with pytest.raises(UserError, match=r"body\.obj: cannot read this mesh"):
        read_urdf_object(path)


def foreign_usd(path: Path, up: str, unit: float) -> None:
    """A case with a lid, in units of a stage whose y or z axis is up, the closed lid at 30°."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    for name, size, middle in (("case", (0.3, 0.2, 0.1), (0, 0, 0.05)), ("lid", (0.3, 0.2, 0.01), (0, -0.1, 0.005))):
        body = UsdGeom.Xform.Define(stage, f"/World/{name}")
        UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
        cube = UsdGeom.Mesh.Define(stage, f"/World/{name}/shape")
        signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2
        points = signs * size + middle
        # With y up, what was at the back is now at the bottom: (x, y, z) becomes (x, z, -y).
        points = points if up == "Z" else np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
        cube.CreatePointsAttr([Gf.Vec3f(*point) for point in (points / unit).tolist()])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        cube.CreateFaceVertexCountsAttr([4] * 6)
        cube.CreateFaceVertexIndicesAttr([corner for quad in quads for corner in quad])
        UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/World/joint")
    joint.CreateBody0Rel().SetTargets(["/World/case"])
    joint.CreateBody1Rel().SetTargets(["/World/lid"])
    joint.CreateAxisAttr("X")
    place = np.array([0, 0.1, 0.1]) if up == "Z" else np.array([0, 0.1, -0.1])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*(place / unit).tolist()))
    joint.CreateLowerLimitAttr(-100.0)
    joint.CreateUpperLimitAttr(0.0)
    stage.Save()


@pytest.mark.parametrize(("up", "unit"), [("Z", 1.0), ("Z", 0.01), ("Y", 0.01)])
def test_usd_in_any_unit_and_either_axis_up(up: str, unit: float, tmp_path: Path) -> None:
    """Sizes come in metres and upright, and the lid opens upwards."""
    path = tmp_path / "case.usda"
    foreign_usd(path, up, unit)
    model = make_imported(read_usd_object(path), "case", tmp_path / "out.usda")
    np.testing.assert_allclose(np.ptp(model.parts[0].vertices, axis=0), [0.3, 0.2, 0.1], atol=1e-6)
    np.testing.assert_allclose(model.hinge_origin, [0, 0.1, 0.1], atol=1e-6)
    assert model.hinge_upper == pytest.approx(np.radians(100))
    assert highest(model, 0.0) == pytest.approx(0.11, abs=1e-6) and highest(model, 1.5) > 0.28
    assert all(len(part.pieces) == 1 for part in model.parts)
    write_object(model)
    assert check_asset(model.path).usable


def test_usd_without_a_hinge_is_refused(tmp_path: Path) -> None:
    """One line says that there is no joint."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.Mesh.Define(stage, "/mesh")
    stage.Save()
    with pytest.raises(UserError, match="joints: expected one PhysicsRevoluteJoint, the hinge, found none"):
        read_usd_object(tmp_path / "a.usda")


def test_an_object_of_the_release_is_read_as_the_import_reads_it(tmp_path: Path) -> None:
    """ARCTIC's box by way of the general reader: masses, centres and hinge are those of the import."""
    folder = os.environ.get("ARTIGRASP_ARCTIC")
    found = sorted(Path(folder).rglob("box.urdf")) if folder else []
    if not found:
        pytest.skip("set ARTIGRASP_ARCTIC to a release that has a box to run this test")
    if "box" not in list_assets("objects"):
        pytest.skip("import ARCTIC's box to run this test")
    # Copies of the release do not all have the meshes; masses and hinge do not depend on them.
    path = tmp_path / "box.urdf"
    path.write_text(re.sub(r"<mesh [^>]*/>", '<box size="0.1 0.1 0.1"/>', found[0].read_text()))
    known, source = load_object("box"), read_urdf_object(path)
    for part, other in zip(source.parts, known.parts, strict=True):
        assert part.body is not None
        assert part.body.mass == pytest.approx(other.mass, rel=1e-5)
        np.testing.assert_allclose(part.body.com, other.com, atol=1e-6)
    np.testing.assert_allclose(source.hinge_axis, known.hinge_axis, atol=1e-6)
    assert source.hinge_upper == pytest.approx(known.hinge_upper)
