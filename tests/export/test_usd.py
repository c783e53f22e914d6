"""Tests of the USD export: valid, true to the motion, and complete."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdValidation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.export.usd import export_usd
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.motion.kinematics import link_poses, part_poses
from tests.motion.example import example_motion

POSITION_TOLERANCE = 1e-4
"""Largest distance between a prim and what it shows [m]."""


def problems(stage: Usd.Stage) -> list[str]:
    """What all of USD's validators find."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    return [f"{error.GetName()}: {error.GetMessage()}" for error in found]


@pytest.mark.parametrize(
    ("suffix", "hands"), [(".usda", ("right",)), (".usdc", ("left", "right")), (".usd", ("left",))]
)
def test_stage_passes_usds_own_validation(tmp_path: Path, suffix: str, hands: tuple[str, ...]) -> None:
    """No validator of USD finds anything, in text and in binary, and nothing else is written."""
    path = tmp_path / f"motion{suffix}"
    export_usd(example_motion(hands=hands), path)
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
    motion = example_motion(hands=("left", "right"), sample_count=20)
    export_usd(motion, tmp_path / "motion.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    links = link_poses(motion, [load_hand("open", side) for side in motion.hands])
    parts = part_poses(motion, load_object("lidded-box"))
    expected = {
        f"/World/Hand{side.capitalize()}/{name}": links[:, hand, link]
        for hand, side in enumerate(motion.hands)
        for link, name in enumerate(LINKS)
    } | {f"/World/Object/{name}": parts[:, part] for part, name in enumerate(PARTS)}
    for sample, time in enumerate(motion.time):
        cache = UsdGeom.XformCache(time * stage.GetTimeCodesPerSecond())
        for path, poses in expected.items():
            matrix = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))
            rotation = matrix.ExtractRotationQuat()
            np.testing.assert_allclose(matrix.ExtractTranslation(), poses[sample, :3], atol=POSITION_TOLERANCE)
            alignment = np.dot([*rotation.GetImaginary(), rotation.GetReal()], poses[sample, 3:])
            assert abs(alignment) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("rate", [None, 60.0])
def test_times_are_kept_at_any_rate(tmp_path: Path, rate: float | None) -> None:
    """Time codes are the samples' times at the rate, and the stage says so."""
    motion = dataclasses.replace(example_motion(sample_count=4), time=[0.0, 0.01, 0.02, 0.04])
    export_usd(motion, tmp_path / "motion.usdc", rate=rate)
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == (rate or 100)
    codes = stage.GetAttributeAtPath("/World/HandRight/wrist.xformOp:translate").GetTimeSamples()
    np.testing.assert_allclose(np.divide(codes, stage.GetTimeCodesPerSecond()), motion.time, atol=1e-7)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (codes[0], codes[-1])


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
    assert (data["format"], data["version"]) == ("artigrasp.motion-usd", 1)
    assert data["metrics"] == motion.metrics and data["provenance"] == motion.provenance
    hinge = UsdPhysics.RevoluteJoint.Get(stage, "/World/Object/hinge")
    assert hinge.GetBody1Rel().GetTargets() == [Sdf.Path("/World/Object/articulated")]
    assert UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/World/Object/base")).GetKinematicEnabledAttr().Get()
    angle = stage.GetAttributeAtPath("/World/Object.artigrasp:hingeAngle")
    np.testing.assert_allclose([angle.Get(code) for code in angle.GetTimeSamples()], motion.hinge_angle)
    for ghost in ("base/TargetGhost/visual", "articulated/ReferenceRight/index3/visual"):
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
        ({}, "motion.usdc", 0.0, "rate: expected a positive number"),
        ({"object": "lided-box"}, "motion.usdc", None, "did you mean 'lidded-box'"),
    ):
        with pytest.raises(UserError, match=message):
            export_usd(dataclasses.replace(example_motion(), **change), tmp_path / name, rate=rate)
    assert list(tmp_path.iterdir()) == []
