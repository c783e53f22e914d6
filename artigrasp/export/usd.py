"""A motion as a USD animation."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.assets.object_usd import write_hinge
from artigrasp.assets.usd_stage import new_stage, set_pose
from artigrasp.errors import UserError
from artigrasp.export.bodies import Body, Colour, hand_bodies, load_models, object_bodies
from artigrasp.export.surface import Surface, link_surface, mesh_surface
from artigrasp.files import atomic_write
from artigrasp.kernels.layout import ARTICULATED, BASE, LINKS, PARTS
from artigrasp.motion.file import Motion, MotionReference
from artigrasp.motion.kinematics import reference_link_poses

MOTION_USD_FORMAT, MOTION_USD_VERSION = "artigrasp.motion-usd", 1
SUFFIXES = (".usdc", ".usda", ".usd")

OBJECT = "/World/Object"
FLOOR_SIZE = 3.0
"""Edge length of the floor [m]."""
FLOOR: Colour = (0.75, 0.75, 0.76)
GHOST: Colour = (0.30, 0.62, 0.42)
GHOST_OPACITY = 0.35
ROUGHNESS = 0.55


def export_usd(motion: Motion, path: str | os.PathLike[str], *, rate: float | None = None) -> None:
    """Write a motion as a time-sampled USD stage in metres, Z up.

    ``/World/HandLeft`` and ``/World/HandRight`` hold one transform per link and ``/World/Object`` one per part, all
    with their surfaces, and the hinge as a physics joint between kinematic bodies. Ghosts of purpose ``guide`` show the
    articulated part at the target angle and, if the motion has one, the reference on the part that it belongs to. Every
    sample of the motion is written at its own time, whatever the rate. The layer's custom data tell the task, the
    policy and the metrics.

    Args:
        motion: The motion.
        path: The file, text or binary by its suffix.
        rate: Time codes per second; by default one per sample of the motion.

    Raises:
        UserError: the motion's hand or object is not among the assets, or the file cannot be written.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise UserError(f"{path}: expected a name that ends in {', '.join(SUFFIXES)}")
    if rate is not None and not 0 < rate < np.inf:
        raise UserError(f"rate: expected a positive number of time codes per second, found {rate}")
    hands, object = load_models(motion)
    stage = new_stage("World", MOTION_USD_FORMAT, MOTION_USD_VERSION)
    _describe(stage, motion)
    codes = _time_codes(stage, motion.time, rate)
    for side, links in zip(motion.hands, hand_bodies(motion, hands), strict=True):
        UsdGeom.Xform.Define(stage, f"/World/Hand{side.capitalize()}")
        for link in links:
            _add_body(stage, f"/World/Hand{side.capitalize()}/{link.name}", link, "Skin", codes)
    _add_object(stage, motion, object, codes)
    _add_target_ghost(stage, motion, object)
    if motion.reference is not None:
        _add_reference_ghosts(stage, motion.reference, hands)
    _add_floor(stage)
    with atomic_write(path) as temporary:
        stage.GetRootLayer().Export(str(temporary))


def _describe(stage: Usd.Stage, motion: Motion) -> None:
    """Tell in the layer's custom data what the motion is."""
    layer = stage.GetRootLayer()
    layer.customLayerData = {
        **layer.customLayerData,
        "hand": motion.hand,
        "object": motion.object,
        "targetAngle": motion.target_angle,
        "metrics": dict(motion.metrics),
        "provenance": dict(motion.provenance),
    }


def _time_codes(stage: Usd.Stage, time: NDArray[np.float64], rate: float | None) -> list[float]:
    """Set the time codes per second of the stage, and return the time code of each sample."""
    if rate is None:
        rate = round(1 / float(np.median(np.diff(time))), 6) if len(time) > 1 else 1.0
    codes = [round(float(code), 6) for code in time * rate]
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])
    return codes


def _add_object(stage: Usd.Stage, motion: Motion, object: ObjectModel, codes: Sequence[float]) -> None:
    """Add the object's parts as kinematic bodies, the hinge between them and its angle."""
    root = UsdGeom.Xform.Define(stage, OBJECT).GetPrim()
    for part in object_bodies(motion, object):
        prim = _add_body(stage, f"{OBJECT}/{part.name}", part, part.name.capitalize(), codes)
        # The recorded motion moves the parts, so physics must not.
        UsdPhysics.RigidBodyAPI.Apply(prim).CreateKinematicEnabledAttr(True)
    write_hinge(stage, OBJECT, object)
    angle = root.CreateAttribute("artigrasp:hingeAngle", Sdf.ValueTypeNames.Double, custom=True)
    for code, value in zip(codes, motion.hinge_angle, strict=True):
        angle.Set(float(value), code)


def _add_target_ghost(stage: Usd.Stage, motion: Motion, object: ObjectModel) -> None:
    """Add the articulated part at the target angle, still in the base, wherever that goes."""
    part = object.parts[ARTICULATED]
    position, orientation = object.articulated_pose_in_base(motion.target_angle)
    ghost = _add_ghost(stage, f"{OBJECT}/{PARTS[BASE]}/TargetGhost")
    set_pose(ghost, position, orientation)
    _add_surface(stage, f"{ghost.GetPath()}/visual", mesh_surface(part.vertices, part.faces), "Ghost", GHOST)


def _add_reference_ghosts(stage: Usd.Stage, reference: MotionReference, hands: Sequence[HandModel]) -> None:
    """Add each hand in its reference pose, still in the part that it belongs to, wherever that goes."""
    poses = reference_link_poses(reference, hands)
    for index, hand in enumerate(hands):
        part = PARTS[reference.part[index]]
        ghost = _add_ghost(stage, f"{OBJECT}/{part}/Reference{hand.side.capitalize()}")
        for link, name in enumerate(LINKS):
            xform = UsdGeom.Xform.Define(stage, f"{ghost.GetPath()}/{name}")
            set_pose(xform.GetPrim(), poses[index, link, :3], poses[index, link, 3:])
            _add_surface(stage, f"{xform.GetPath()}/visual", link_surface(hand, link), "Ghost", GHOST)


def _add_ghost(stage: Usd.Stage, path: str) -> Usd.Prim:
    xform = UsdGeom.Xform.Define(stage, path)
    xform.CreatePurposeAttr(UsdGeom.Tokens.guide)
    return xform.GetPrim()


def _add_floor(stage: Usd.Stage) -> None:
    half = FLOOR_SIZE / 2
    corners = np.array([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])
    _add_surface(stage, "/World/Floor", mesh_surface(corners, np.array([[0, 1, 2], [0, 2, 3]])), "Floor", FLOOR)


def _add_body(stage: Usd.Stage, path: str, body: Body, material: str, codes: Sequence[float]) -> Usd.Prim:
    """Add a body with its surface, moving through the time codes."""
    xform = UsdGeom.Xform.Define(stage, path)
    # Double precision: USD takes the angle of a rotation from the arc cosine of w, which turns the rounding of a float
    # near one into a third of a milliradian.
    double = UsdGeom.XformOp.PrecisionDouble
    translate, orient = xform.AddTranslateOp(double), xform.AddOrientOp(double)
    for code, pose in zip(codes, _continuous(body.poses).tolist(), strict=True):
        x, y, z, qx, qy, qz, qw = pose
        translate.Set(Gf.Vec3d(x, y, z), code)
        orient.Set(Gf.Quatd(qw, qx, qy, qz).GetNormalized(), code)
    _add_surface(stage, f"{path}/visual", body.surface, material, body.colours)
    return xform.GetPrim()


def _continuous(poses: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same poses, of q and -q always the one nearer to the sample before: interpolation goes the short way."""
    poses = poses.copy()
    flips = np.sum(poses[1:, 3:] * poses[:-1, 3:], axis=1) < 0
    poses[1:, 3:] *= np.where(np.cumsum(flips) % 2, -1, 1)[:, None]
    return poses


def _add_surface(stage: Usd.Stage, path: str, surface: Surface, material: str, colours: ArrayLike) -> None:
    """Add a mesh of one colour, or with one for each face, shape ``[F, 3]``.

    It is bound to the material of this name, which the first mesh that needs it makes; where there are several colours,
    the faces of each are bound to one of their own.
    """
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(surface.vertices.astype(np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(surface.faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(surface.faces.astype(np.int32).ravel()))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(surface.corner_normals.astype(np.float32).reshape(-1, 3)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    palette, index = np.unique(np.broadcast_to(colours, surface.faces.shape), axis=0, return_inverse=True)
    shown = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform if len(palette) > 1 else UsdGeom.Tokens.constant)
    shown.Set(Vt.Vec3fArray.FromNumpy(palette.astype(np.float32)))
    if len(palette) == 1:
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(_material(stage, material, palette[0]))
        return
    shown.SetIndices(Vt.IntArray.FromNumpy(index.ravel().astype(np.int32)))
    for number, colour in enumerate(palette):
        faces = Vt.IntArray.FromNumpy(np.flatnonzero(index == number).astype(np.int32))
        subset = UsdShade.MaterialBindingAPI(mesh).CreateMaterialBindSubset(f"colour_{number:02d}", faces)
        name = f"{material}{number:02d}"
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(_material(stage, name, colour))


def _material(stage: Usd.Stage, name: str, colour: NDArray[np.float64]) -> UsdShade.Material:
    UsdGeom.Scope.Define(stage, "/World/Materials")
    path = f"/World/Materials/{name}"
    if stage.GetPrimAtPath(path):
        return UsdShade.Material.Get(stage, path)
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour.tolist()))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(GHOST_OPACITY if name == "Ghost" else 1.0)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), UsdShade.Tokens.surface)
    return material
