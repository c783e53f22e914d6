"""Other people's hinged objects, in URDF and USD, become ours."""

import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from artigrasp.assets import cutting
from artigrasp.assets.check import check_asset
from artigrasp.assets.imported_object import make_imported
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import ObjectModel, load_object, read_object, write_object
from artigrasp.assets.urdf_object import read_urdf_object
from artigrasp.assets.usd_object import read_usd_object
from artigrasp.errors import UserError
from tests.assets.foreign import HINGE, LINK, foreign_urdf, foreign_usd


def imported(path: Path) -> ObjectModel:
    """The object in a file, as ours."""
    return make_imported(read_urdf_object(path), "case", path.with_suffix(".usda"))


def highest(model: ObjectModel, angle: float) -> float:
    """Height of the lid's front edge [m]."""
    return float(model.vertices_in_base(angle)[len(model.parts[0].vertices) :, 2].max())


def test_urdf_keeps_places_masses_and_the_way_it_opens(tmp_path: Path) -> None:
    """In the base's frame at angle 0, every number is the one that the links and the joint say."""
    model = imported(foreign_urdf(tmp_path))
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
        model = imported(foreign_urdf(tmp_path, axis=axis, lower=lower, upper=upper))
        assert highest(model, 1.5) > highest(model, 0.0) + 0.15
    turned = imported(foreign_urdf(tmp_path, axis="0 2 0", lower=0.5, upper=2.0))
    assert turned.hinge_upper == pytest.approx(1.5) and highest(turned, 0.0) == pytest.approx(
        0.1 + 0.2 * np.sin(0.5), abs=0.01
    )


def test_links_that_are_fixed_to_each_other_are_one_part(tmp_path: Path) -> None:
    """A knob on the lid adds its mass, and its shape, to the lid's."""
    knob = LINK.format(name="knob", com="0 0 0", mass=0.1, at="0 0 .02", size=".02 .02 .02")
    joint = '<joint name="glue" type="fixed"><parent link="lid"/><child link="knob"/><origin xyz="-.18 0 0"/></joint>'
    model = imported(foreign_urdf(tmp_path, more=knob + joint))
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
        read_urdf_object(foreign_urdf(tmp_path, **changes))  # type: ignore[arg-type]


def test_missing_mesh_is_named(tmp_path: Path) -> None:
    """A mesh that is not there, or is none, is named."""
    path = foreign_urdf(tmp_path)
    path.write_text(path.read_text().replace('<box size=".3 .2 .1"/>', '<mesh filename="package://case/body.obj"/>'))
    with pytest.raises(UserError, match=r"body\.obj: expected a mesh, found nothing"):
        read_urdf_object(path)
    (tmp_path / "body.obj").write_text("hello")
    with pytest.raises(UserError, match=r"body\.obj: cannot read this mesh"):
        read_urdf_object(path)


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


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("int[] faceVertexIndices = ", "int[] nothing = ", "expected points and faces of them"),
        ("point3f[] points = ", "double points = 1 # ", "it holds values of other types than it says"),
        ("[4, 4, 4, 4, 4, 4]", "[30, -2, -1, -1, -1, -1]", "expected points and faces of them"),
        ("(-0.15, ", "(nan, ", "expected points and faces of them"),
        ('upAxis = "Z"', 'upAxis = "X"', "expected y or z up, and a positive unit of length, found X"),
        ("metersPerUnit = 1", "metersPerUnit = 0", "and a positive unit of length, found Z and 0.0 m"),
        ('physics:axis = "X"', 'physics:axis = "W"', "axis: expected X, Y or Z, found W"),
        ("physics:localPos0 = (0,", "physics:localPos0 = (inf,", "expected a position and an orientation, found"),
        (", 0.1)", ", 0)", "part 1: expected a shape with a volume"),
    ],
)
def test_usd_with_numbers_that_cannot_be(old: str, new: str, message: str, tmp_path: Path) -> None:
    """One line says what is wrong, and where."""
    path = tmp_path / "case.usda"
    foreign_usd(path, "Z", 1.0)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(UserError, match=message) as caught:
        make_imported(read_usd_object(path), "case", tmp_path / "out.usda")
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_usd_that_breaks_its_reader_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the process that opens it is ended, for the time or the memory that it takes, one line names the file."""
    path = tmp_path / "case.usdc"
    foreign_usd(path, "Z", 1.0)
    assert read_usd_object(path).hinge_upper > 1.0
    program = "import os, signal; os.kill(os.getpid(), signal.SIGXCPU)"
    end = tmp_path / "python"
    end.write_text(f"#!{sys.executable}\n{program}\n")
    end.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(end))
    with pytest.raises(UserError, match=r"case\.usdc: cannot read this as USD: it takes too long"):
        read_usd_object(path)


def test_a_mesh_that_ends_the_cutter_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """CoACD, which is native code, does not survive this lid: a box that was pulled through itself."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(cutting, "ATTEMPTS", cutting.ATTEMPTS[:1])
    path = tmp_path / "case.usda"
    foreign_usd(path, "Z", 0.01)
    text = path.read_text()
    lid = "(-15, -20, 0), (-15, -20, 1), (-15, 0, 0), (-15, 0, 1)"
    assert lid in text
    path.write_text(text.replace(lid, lid.replace("(-15, 0, 0)", "(-15, 0, 5)")))
    with pytest.raises(UserError, match=r"case.usda: part 2: cannot cut this mesh into convex pieces: exit code -11"):
        make_imported(read_usd_object(path), "case", tmp_path / "o.usda")
