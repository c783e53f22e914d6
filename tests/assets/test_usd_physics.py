"""Nothing in an asset's file is simulated that was not read from it."""

from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from artigrasp.assets.hand import read_hand
from artigrasp.assets.library import find_asset
from artigrasp.assets.object import read_object
from artigrasp.assets.usd_physics import check_physics
from artigrasp.errors import UserError

BOX, HAND = ("objects", "lidded-box"), ("hands", "open_right")


def without_articulation(stage: Usd.Stage) -> None:
    """The importer would find a joint that belongs to nothing."""
    stage.GetDefaultPrim().RemoveAppliedSchema("PhysicsArticulationRootAPI")


def without_child(stage: Usd.Stage) -> None:
    """The importer would write where no body is."""
    stage.GetPrimAtPath("/Object/hinge").GetRelationship("physics:body1").ClearTargets(True)


def other_way_round(stage: Usd.Stage) -> None:
    """A hinge that closes where it should open."""
    hinge = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath("/Object/hinge"))
    hinge.GetBody0Rel().SetTargets(["/Object/articulated"])
    hinge.GetBody1Rel().SetTargets(["/Object/base"])


def moved_piece(stage: Usd.Stage) -> None:
    """Hands would touch what nobody sees."""
    UsdGeom.Xformable(stage.GetPrimAtPath("/Object/base/pieces/piece_00")).AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))


def mesh_as_it_is(stage: Usd.Stage) -> None:
    """A collision mesh that is not made convex."""
    UsdPhysics.MeshCollisionAPI(stage.GetPrimAtPath("/Object/base/pieces/piece_00")).GetApproximationAttr().Set("none")


def another_joint(stage: Usd.Stage) -> None:
    """The lid is welded to the base."""
    weld = UsdPhysics.FixedJoint.Define(stage, "/Object/weld")
    weld.CreateBody0Rel().SetTargets(["/Object/base"])
    weld.CreateBody1Rel().SetTargets(["/Object/articulated"])


def gravity(stage: Usd.Stage) -> None:
    """Everything falls up."""
    UsdPhysics.Scene.Define(stage, "/Object/scene").CreateGravityDirectionAttr(Gf.Vec3f(0, 0, 1))


def disabled(stage: Usd.Stage) -> None:
    """The lid flies away."""
    UsdPhysics.Joint(stage.GetPrimAtPath("/Object/hinge")).CreateJointEnabledAttr(False)


def moved_link(stage: Usd.Stage) -> None:
    """A finger begins where its joint is not."""
    stage.GetPrimAtPath("/Hand/index2").GetAttribute("xformOp:translate").Set(Gf.Vec3d(1, 0, 0))


def turned_joint(stage: Usd.Stage) -> None:
    """Angles mean something else."""
    turn = UsdPhysics.Joint(stage.GetPrimAtPath("/Hand/index2_joint")).GetLocalRot1Attr()
    turn.Set(Gf.Quatf(0.0, 1.0, 0.0, 0.0))


def lying_capsule(stage: Usd.Stage) -> None:
    """A finger as thick as it is long."""
    (capsule, *_) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Capsule))
    UsdGeom.Capsule(capsule).GetAxisAttr().Set("X")


def spring(stage: Usd.Stage) -> None:
    """A joint that pulls by itself."""
    UsdPhysics.DriveAPI.Get(stage.GetPrimAtPath("/Hand/index2_joint"), "rotX").GetStiffnessAttr().Set(100.0)


@pytest.mark.parametrize(
    ("asset", "change", "message"),
    [
        (BOX, without_articulation, "/Object: schemas: expected 'PhysicsArticulationRootAPI', found ''"),
        (BOX, without_child, "/Object/hinge: physics:body1: expected '/Object/articulated', found none"),
        (BOX, other_way_round, "/Object/hinge: physics:body0: expected '/Object/base'"),
        (BOX, moved_piece, "/Object/base/pieces/piece_00: xformOp:translate: expected none, found '(0, 0, 1)'"),
        (BOX, mesh_as_it_is, "physics:approximation: expected 'convexHull', found 'none'"),
        (BOX, another_joint, "/Object/weld: expected no physics, found PhysicsFixedJoint"),
        (BOX, gravity, "/Object/scene: expected no physics, found PhysicsScene"),
        (BOX, disabled, "/Object/hinge: physics:jointEnabled: expected none, found 'False'"),
        (HAND, moved_link, "/Hand/index2: xformOp:translate: expected"),
        (HAND, turned_joint, "/Hand/index2_joint: physics:localRot1: expected"),
        (HAND, lying_capsule, "axis: expected 'Z', found 'X'"),
        (HAND, spring, "/Hand/index2_joint: drive:rotX:physics:stiffness: expected '0.0', found '100.0'"),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_other_physics_is_refused(
    asset: tuple[str, str], change: Callable[[Usd.Stage], None], message: str, tmp_path: Path
) -> None:
    """What is read would be the same hand or object; what is simulated would not."""
    path = tmp_path / "changed.usda"
    layer = Sdf.Layer.CreateAnonymous()
    layer.ImportFromString(find_asset(*asset).read_text())  # type: ignore[arg-type]
    stage = Usd.Stage.Open(layer)
    change(stage)
    path.write_text(layer.ExportToString())
    with pytest.raises(UserError) as caught:
        (read_object if asset == BOX else read_hand)(path)
    assert str(caught.value).startswith(f"{path}: ") and message in str(caught.value)


def test_the_sign_of_a_quaternion_says_nothing(tmp_path: Path) -> None:
    """Both signs are one rotation; what is seen only is nobody's business."""
    stage = Usd.Stage.Open(str(find_asset("objects", "lidded-box")))
    other = Usd.Stage.Open(stage.Flatten())
    turn = UsdPhysics.Joint(other.GetPrimAtPath("/Object/hinge")).GetLocalRot0Attr()
    turn.Set(-turn.Get())
    UsdGeom.Sphere.Define(other, "/Object/base/knob")
    check_physics(tmp_path, other, stage)
