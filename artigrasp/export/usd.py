"""Motions as a USD animation."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdPhysics

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.assets.object_usd import write_hinge
from artigrasp.assets.usd_stage import new_stage, set_pose
from artigrasp.errors import UserError, unknown
from artigrasp.export.bodies import Body, bystander_bodies, hand_bodies, load_models, object_bodies, stage_surface
from artigrasp.export.surface import Surface, mesh_surface, part_surface
from artigrasp.export.usd_hands import HAND_LOOKS, HandLook, add_hand, add_hand_ghost
from artigrasp.export.usd_prims import add_body, add_ghost, add_surface, haunt, paint
from artigrasp.files import atomic_write
from artigrasp.kernels.layout import ARTICULATED, BASE, PARTS
from artigrasp.motion.file import Motion, MotionReference
from artigrasp.motion.kinematics import reference_link_poses
from artigrasp.motion.resampling import resample

MOTION_USD_FORMAT, MOTION_USD_VERSION = "artigrasp.motion-usd", 2
SUFFIXES = (".usdc", ".usda", ".usd")

WORLD = "/World"
_LARGEST_RATE = 100_000.0
"""Time codes per second."""
SPACING = 1.0
"""Between motions that are shown side by side [m]."""
FLOOR_MARGIN = 1.5
"""How far the floor reaches beyond the motions [m]."""
FLOOR_COLOUR = (0.75, 0.75, 0.76)
STAGE_COLOUR = (0.55, 0.56, 0.58)


def export_usd(
    motion: Motion | Sequence[Motion],
    path: str | os.PathLike[str],
    *,
    rate: float | None = None,
    hands: HandLook = "skinned",
) -> None:
    """Write a motion, or several side by side, as a time-sampled USD stage in metres, Z up.

    ``/World/HandLeft`` and ``/World/HandRight`` are the hands. ``/World/Object`` holds the object's parts, and the
    hinge as a physics joint between kinematic bodies; further objects of the scene are ``/World/Object2`` and so on.
    Ghosts of purpose ``guide`` show the articulated part at the target angle, the object at its target, and the
    reference on the part that it belongs to, as far as the motion knows them. Several motions are below
    ``/World/Motion1`` and so on, in rows. Custom data tell task, policy and metrics: the layer's of one motion, each
    prim's of several.

    Args:
        motion: The motion, or several.
        path: The file, text or binary by its suffix.
        rate: Time codes per second; the motion is sampled at every one. By default each sample of the (first) motion
            is at a time code of its own, and all are written as they are.
        hands: ``"skinned"``: UsdSkel characters; ``"baked"``: meshes whose points move, for programs that know no
            UsdSkel; ``"links"``: rigid bodies, the shapes that collide.

    Raises:
        UserError: a hand or object is not among the assets, or the file cannot be written.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise UserError(f"{path}: expected a name that ends in {', '.join(SUFFIXES)}")
    if rate is not None and not 0 < rate <= _LARGEST_RATE:
        raise UserError(f"rate: expected more than 0 to {_LARGEST_RATE:g} time codes per second, found {rate:g}")
    if hands not in HAND_LOOKS:
        raise unknown("look of hands", hands, HAND_LOOKS)
    motions = [motion] if isinstance(motion, Motion) else list(motion)
    if not motions:
        raise UserError("expected one or more motions, found none")
    stage = new_stage("World", MOTION_USD_FORMAT, MOTION_USD_VERSION)
    if rate is None:
        codes = _set_time(stage, motions, _own_rate(motions[0].time))
    else:
        motions = [resample(each, _even_times(each.time, rate)) for each in motions]
        codes = _set_time(stage, motions, rate)
    if len(motions) == 1:
        layer = stage.GetRootLayer()
        layer.customLayerData = {**layer.customLayerData, **_description(motions[0])}
        _add_motion(stage, WORLD, motions[0], hands, codes[0])
    places = _places(len(motions))
    for number, (each, place) in enumerate(zip(motions, places, strict=True) if len(motions) > 1 else (), start=1):
        prim = UsdGeom.Xform.Define(stage, f"{WORLD}/Motion{number}").GetPrim()
        set_pose(prim, place)
        prim.SetCustomData(_description(each))
        _add_motion(stage, str(prim.GetPath()), each, hands, codes[number - 1])
    _add_floor(stage, places)
    with atomic_write(path) as temporary:
        stage.GetRootLayer().Export(str(temporary))


def _description(motion: Motion) -> dict[str, object]:
    """What a motion is."""
    return {
        "hand": motion.hand,
        "object": motion.object,
        "targetAngle": motion.target_angle,
        "metrics": dict(motion.metrics),
        "provenance": dict(motion.provenance),
    }


def _own_rate(time: Array) -> float:
    """Samples per second of a motion."""
    return round(1 / float(np.median(np.diff(time))), 6) if len(time) > 1 else 1.0


def _even_times(time: Array, rate: float) -> Array:
    """Every multiple of the interval within a motion [s], or its only sample."""
    first, last = np.ceil(time[0] * rate - 1e-6), np.floor(time[-1] * rate + 1e-6)
    return np.arange(first, last + 1) / rate if last >= first else time[:1]


def _set_time(stage: Usd.Stage, motions: Sequence[Motion], rate: float) -> list[list[float]]:
    """Set the time codes of the stage; those of each motion's samples."""
    codes = [[round(float(code), 6) for code in motion.time * rate] for motion in motions]
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(min(each[0] for each in codes))
    stage.SetEndTimeCode(max(each[-1] for each in codes))
    return codes


def _places(count: int) -> Array:
    """Where motions are, in rows about the origin [m], shape ``[count, 3]``."""
    columns = int(np.ceil(np.sqrt(count)))
    cells = np.array([(index % columns, -(index // columns), 0) for index in range(count)], float)
    return np.asarray(SPACING * (cells - (cells.min(axis=0) + cells.max(axis=0)) / 2))


def _add_motion(stage: Usd.Stage, root: str, motion: Motion, look: HandLook, codes: Sequence[float]) -> None:
    """Add all that a motion shows below the prim ``root``."""
    hands, object = load_models(motion)
    for hand, links in zip(hands, hand_bodies(motion, hands), strict=True):
        add_hand(stage, f"{root}/Hand{hand.side.capitalize()}", hand, links, look, codes)
    _add_object(stage, f"{root}/Object", object, object_bodies(motion, object), motion.hinge_angle, codes)
    _add_target_ghosts(stage, root, motion, object)
    if motion.reference is not None:
        _add_reference_ghosts(stage, f"{root}/Object", motion.reference, hands, look)
    for number, (model, bodies, angles) in enumerate(bystander_bodies(motion), start=2):
        _add_object(stage, f"{root}/Object{number}", model, bodies, angles, codes)
    if motion.stage is not None:
        paint(stage, add_surface(stage, f"{root}/Stage", stage_surface(motion.stage)), STAGE_COLOUR)


def _add_object(
    stage: Usd.Stage,
    path: str,
    object: ObjectModel,
    bodies: Sequence[Body],
    hinge_angle: NDArray[np.float32],
    codes: Sequence[float],
) -> None:
    """Add an object's parts as kinematic bodies, the hinge between them and its angle."""
    root = UsdGeom.Xform.Define(stage, path).GetPrim()
    root.SetCustomDataByKey("object", object.name)
    for body in bodies:
        prim = add_body(stage, f"{path}/{body.name}", body, codes)
        # The recorded motion moves the parts, so physics must not.
        UsdPhysics.RigidBodyAPI.Apply(prim).CreateKinematicEnabledAttr(True)
    write_hinge(stage, path, object)
    angle = root.CreateAttribute("artigrasp:hingeAngle", Sdf.ValueTypeNames.Double, custom=True)
    for code, value in zip(codes, hinge_angle, strict=True):
        angle.Set(float(value), code)


def _add_target_ghosts(stage: Usd.Stage, root: str, motion: Motion, object: ObjectModel) -> None:
    """Add the articulated part at the target angle, on the base wherever that goes, and the base where it should go."""
    surfaces = [part_surface(part)[0] for part in object.parts]
    turned = object.articulated_pose_in_base(motion.target_angle)
    ghost = add_ghost(stage, f"{root}/Object/{PARTS[BASE]}/TargetGhost")
    set_pose(ghost, *turned)
    _add_ghost_surface(stage, ghost, surfaces[ARTICULATED])
    if motion.target_object_pose is None:
        return
    target = add_ghost(stage, f"{root}/TargetGhost")
    set_pose(target, motion.target_object_pose[:3], motion.target_object_pose[3:])
    for name, surface, pose in zip(
        PARTS, surfaces, ((np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), turned), strict=True
    ):
        part = UsdGeom.Xform.Define(stage, f"{target.GetPath()}/{name}").GetPrim()
        set_pose(part, *pose)
        _add_ghost_surface(stage, part, surface)


def _add_ghost_surface(stage: Usd.Stage, parent: Usd.Prim, surface: Surface) -> None:
    haunt(stage, add_surface(stage, f"{parent.GetPath()}/visual", surface))


def _add_reference_ghosts(
    stage: Usd.Stage, object_path: str, reference: MotionReference, hands: Sequence[HandModel], look: HandLook
) -> None:
    """Add each hand in its reference pose, still in the part that it belongs to, wherever that goes."""
    poses = reference_link_poses(reference, hands)
    for index, hand in enumerate(hands):
        part = PARTS[reference.part[index]]
        add_hand_ghost(stage, f"{object_path}/{part}/Reference{hand.side.capitalize()}", hand, poses[index], look)


def _add_floor(stage: Usd.Stage, places: Array) -> None:
    low, high = (places.min(axis=0) - FLOOR_MARGIN)[:2], (places.max(axis=0) + FLOOR_MARGIN)[:2]
    corners = np.array([[low[0], low[1], 0.0], [high[0], low[1], 0.0], [high[0], high[1], 0.0], [low[0], high[1], 0.0]])
    floor = add_surface(stage, f"{WORLD}/Floor", mesh_surface(corners, np.array([[0, 1, 2], [0, 2, 3]])))
    paint(stage, floor, FLOOR_COLOUR)
