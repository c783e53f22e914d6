"""Tests of the USD export: valid, true to the motion, and complete."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdSkel, UsdValidation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import StageConfig
from artigrasp.errors import UserError
from artigrasp.export.hand_surface import skin_of
from artigrasp.export.usd import export_usd
from artigrasp.export.usd_hands import HandLook
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.motion.file import Motion, MotionBystanders
from artigrasp.motion.kinematics import link_poses, part_poses, pose_object
from tests.motion.example import example_motion, random_poses

POSITION_TOLERANCE = 1e-4
"""Largest distance between a prim and what it shows [m]."""


def problems(stage: Usd.Stage) -> list[str]:
    """What all of USD's validators find."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    return [f"{error.GetName()}: {error.GetMessage()}" for error in found]


def whole_scene(hands: tuple[str, ...] = ("left", "right")) -> Motion:
    """A motion of all that there can be: a second object, a stage and a target pose, 5 samples at 100 Hz."""
    motion = example_motion(hands=hands)
    bystanders = MotionBystanders(
        objects=("open-laptop",),
        pose=random_poses(np.random.default_rng(1), 5, 1),
        hinge_angle=np.linspace(0, 0.5, 5)[:, None],
        focus=np.zeros(5, np.int64),
    )
    return dataclasses.replace(
        motion,
        bystanders=bystanders,
        stage=StageConfig(0.1, (0.4, 0.3), (0.2, 0.0)),
        target_object_pose=motion.object_pose[-1],
    )


def skinned_points(stage: Usd.Stage, path: str, code: float) -> np.ndarray:
    """The points of a hand's surface in the world as UsdSkel computes them, shape ``[V, 3]``."""
    cache, root = UsdSkel.Cache(), UsdSkel.Root.Get(stage, path)
    assert cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    skeleton, (skinned,) = cache.GetSkelQuery(binding.GetSkeleton()), binding.GetSkinningTargets()
    points = UsdGeom.Mesh(skinned.GetPrim()).GetPointsAttr().Get()
    assert skinned.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(code), points, code)
    to_world = UsdGeom.XformCache(code).GetLocalToWorldTransform(skeleton.GetPrim())
    return np.array([to_world.Transform(Gf.Vec3d(point)) for point in points])


@pytest.mark.parametrize(
    ("suffix", "hands", "look"),
    [(".usda", ("right",), "skinned"), (".usdc", ("left", "right"), "links"), (".usd", ("left",), "baked")],
)
def test_stage_passes_usds_own_validation(tmp_path: Path, suffix: str, hands: tuple[str, ...], look: HandLook) -> None:
    """No validator of USD finds anything, in text and in binary, and nothing else is written."""
    path = tmp_path / f"motion{suffix}"
    export_usd(whole_scene(hands), path, hands=look)
    assert problems(Usd.Stage.Open(str(path))) == []
    assert list(tmp_path.iterdir()) == [path]


def test_validation_sees_a_fault(tmp_path: Path) -> None:
    """The validators are loaded and at work: a hinge to nowhere does not pass."""
    path = tmp_path / "motion.usda"
    export_usd(example_motion(), path)
    stage = Usd.Stage.Open(str(path))
    UsdPhysics.Joint.Get(stage, "/World/Object/hinge").GetBody1Rel().SetTargets(["/World/Nothing"])
    assert problems(stage)


def test_prims_are_where_the_motion_is(tmp_path: Path) -> None:
    """At every sample all links and parts have the motion's poses, read back as any other program would."""
    motion = whole_scene()
    export_usd(motion, tmp_path / "motion.usdc", hands="links")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    links = link_poses(motion, [load_hand("open", side) for side in motion.hands])
    parts = part_poses(motion, load_object("lidded-box"))
    assert motion.bystanders is not None
    others = pose_object(motion.bystanders.pose[:, 0], motion.bystanders.hinge_angle[:, 0], load_object("open-laptop"))
    expected = {
        f"/World/Hand{side.capitalize()}/{name}": links[:, hand, link]
        for hand, side in enumerate(motion.hands)
        for link, name in enumerate(LINKS)
    }
    expected |= {f"/World/Object/{name}": parts[:, part] for part, name in enumerate(PARTS)}
    expected |= {f"/World/Object2/{name}": others[:, part] for part, name in enumerate(PARTS)}
    for sample, time in enumerate(motion.time):
        cache = UsdGeom.XformCache(time * stage.GetTimeCodesPerSecond())
        for path, poses in expected.items():
            matrix = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))
            rotation = matrix.ExtractRotationQuat()
            np.testing.assert_allclose(matrix.ExtractTranslation(), poses[sample, :3], atol=POSITION_TOLERANCE)
            alignment = np.dot([*rotation.GetImaginary(), rotation.GetReal()], poses[sample, 3:])
            assert abs(alignment) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("rate", [None, 100.0])
def test_usdskel_bends_hands_as_the_motion_does(tmp_path: Path, rate: float | None) -> None:
    """UsdSkel's own skinning puts every vertex where the motion's hand has it, and baked points are there."""
    motion = example_motion(hands=("left", "right"), sample_count=20)
    for look in ("skinned", "baked"):
        export_usd(motion, tmp_path / f"{look}.usdc", hands=look, rate=rate)
    skinned, baked = (Usd.Stage.Open(str(tmp_path / f"{look}.usdc")) for look in ("skinned", "baked"))
    hands = [load_hand("open", side) for side in motion.hands]
    poses = link_poses(motion, hands)
    for index, hand in enumerate(hands):
        path = f"/World/Hand{hand.side.capitalize()}"
        for sample in (0, 7, 19):
            expected = skin_of(hand).posed(poses[sample, index])
            code = motion.time[sample] * skinned.GetTimeCodesPerSecond()
            np.testing.assert_allclose(skinned_points(skinned, path, code), expected, atol=POSITION_TOLERANCE)
            points = UsdGeom.Mesh.Get(baked, f"{path}/surface").GetPointsAttr().Get(code)
            np.testing.assert_allclose(points, expected, atol=POSITION_TOLERANCE)
    joints = UsdSkel.Skeleton.Get(skinned, "/World/HandRight/skeleton").GetJointsAttr().Get()
    assert [joint.rsplit("/", 1)[-1] for joint in joints] == list(LINKS)


def test_motions_stand_side_by_side(tmp_path: Path) -> None:
    """Each is below a prim of its own, a metre from the next, with its own metadata, and plays from its own start."""
    first = example_motion()
    second = dataclasses.replace(example_motion(sample_count=9), metrics={"aae": 0.5})
    export_usd([first, second, first], tmp_path / "motions.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "motions.usdc"))
    assert problems(stage) == []
    cache = UsdGeom.XformCache(0.0)
    places = [
        cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"/World/Motion{number}")).ExtractTranslation()
        for number in (1, 2, 3)
    ]
    assert all(np.linalg.norm(np.subtract(a, b)) > 0.99 for a, b in itertools.combinations(places, 2))
    assert stage.GetPrimAtPath("/World/Motion2").GetCustomDataByKey("metrics") == {"aae": 0.5}
    assert stage.GetEndTimeCode() == 8


def test_times_are_kept(tmp_path: Path) -> None:
    """Without a rate every sample is written at its own time."""
    motion = dataclasses.replace(example_motion(sample_count=4), time=[0.0, 0.01, 0.02, 0.04])
    export_usd(motion, tmp_path / "motion.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 100
    codes = stage.GetAttributeAtPath("/World/Object/base.xformOp:translate").GetTimeSamples()
    np.testing.assert_allclose(np.divide(codes, stage.GetTimeCodesPerSecond()), motion.time, atol=1e-7)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (codes[0], codes[-1])


def test_a_rate_samples_the_motion(tmp_path: Path) -> None:
    """There is a sample at every time code, and between two samples of the motion it is in between."""
    motion = example_motion(sample_count=11)
    export_usd(motion, tmp_path / "motion.usdc", rate=40.0)
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    translate = stage.GetAttributeAtPath("/World/Object/base.xformOp:translate")
    assert translate.GetTimeSamples() == [0, 1, 2, 3, 4] and stage.GetTimeCodesPerSecond() == 40
    np.testing.assert_allclose(translate.Get(2), motion.object_pose[5, :3], atol=1e-6)
    np.testing.assert_allclose(translate.Get(1), motion.object_pose[2:4, :3].mean(axis=0), atol=1e-6)


def test_quaternions_take_the_short_way(tmp_path: Path) -> None:
    """Neighbouring samples never have quaternions of opposite sign."""
    motion = example_motion(sample_count=6)
    motion.object_pose[1::2] = motion.object_pose[::2]
    motion.object_pose[1::2, 3:] *= -1
    export_usd(motion, tmp_path / "motion.usda")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usda"))
    orient = stage.GetAttributeAtPath("/World/Object/base.xformOp:orient")
    values = [orient.Get(code) for code in orient.GetTimeSamples()]
    quaternions = np.array([[*value.GetImaginary(), value.GetReal()] for value in values])
    assert (np.sum(quaternions[1:] * quaternions[:-1], axis=1) >= 0).all()


def test_stage_says_what_it_is(tmp_path: Path) -> None:
    """Units, default prim, provenance, hinge, kinematic parts and ghosts are there."""
    motion = example_motion()
    export_usd(motion, tmp_path / "motion.usda")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usda"))
    assert stage.GetDefaultPrim().GetPath() == "/World"
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    data = stage.GetRootLayer().customLayerData
    assert (data["format"], data["version"]) == ("artigrasp.motion-usd", 2)
    assert data["metrics"] == motion.metrics and data["provenance"] == motion.provenance
    hinge = UsdPhysics.RevoluteJoint.Get(stage, "/World/Object/hinge")
    assert hinge.GetBody1Rel().GetTargets() == [Sdf.Path("/World/Object/articulated")]
    assert UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/World/Object/base")).GetKinematicEnabledAttr().Get()
    angle = stage.GetAttributeAtPath("/World/Object.artigrasp:hingeAngle")
    np.testing.assert_allclose([angle.Get(code) for code in angle.GetTimeSamples()], motion.hinge_angle)
    for ghost in ("base/TargetGhost/visual", "articulated/ReferenceRight/surface"):
        prim = stage.GetPrimAtPath(f"/World/Object/{ghost}")
        assert prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() == "guide"


def test_target_ghost_is_at_the_target(tmp_path: Path) -> None:
    """When the hinge reaches the target the ghost and the articulated part coincide."""
    motion = dataclasses.replace(example_motion(sample_count=2), hinge_angle=[0.0, 1.25], target_angle=1.25)
    export_usd(motion, tmp_path / "motion.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    cache = UsdGeom.XformCache(stage.GetEndTimeCode())
    ghost, part = (
        np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"/World/Object/{name}")))
        for name in ("base/TargetGhost", "articulated")
    )
    np.testing.assert_allclose(ghost, part, atol=1e-6)


def test_bad_requests_leave_nothing_behind(tmp_path: Path) -> None:
    """Another kind of file, a rate that is none and an unknown object are the user's mistakes."""
    for change, name, rate, message in (
        ({}, "motion.obj", None, "expected a name that ends in .usdc"),
        ({}, "motion.usdc", 0.0, "rate: expected more than 0"),
        ({"object": "lided-box"}, "motion.usdc", None, "did you mean 'lidded-box'"),
    ):
        with pytest.raises(UserError, match=message):
            export_usd(dataclasses.replace(example_motion(), **change), tmp_path / name, rate=rate)
    assert list(tmp_path.iterdir()) == []
