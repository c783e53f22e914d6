"""Hands as USD files: a physics articulation that Newton's own importer reads, and back to numbers.

``/Hand`` is the articulation. Below it ``base`` is a body fixed to the world, the 16 links are bodies placed in the
zero pose, ``<link>_joint`` is the generic joint to the parent, and each fingertip is a site on its link. ``skin`` is
what is seen; collision shapes are guides where there is one. Every joint carries its damping and armature per axis as
``artigrasp:damping`` and ``artigrasp:armature``; where one number does for all of its axes the joint has it as
``newton:damping`` and ``newton:armature`` too, which the importer applies. The wrist joint mixes slides and turns, so
there a scene must set both from the :class:`HandModel`.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import Box, Capsule, Collider, HandModel
from artigrasp.assets.hand_skin import SKIN_COLOUR
from artigrasp.assets.skin_usd import define_skin, read_skin
from artigrasp.assets.usd_physics import check_physics
from artigrasp.assets.usd_stage import StageReader, new_stage, save_stage, set_attribute, set_mass, set_pose, vector
from artigrasp.kernels.layout import DOF_COUNT, HANDS, LINK_PARENTS, LINKS, TIP_FINGERS, TIP_LINKS, WRIST_DOF_COUNT

FORMAT, VERSION = "artigrasp.hand", 2
"""Since version 2 a hand has a skin."""

LINEAR_AXES = ("transX", "transY", "transZ")
ANGULAR_AXES = ("rotX", "rotY", "rotZ")
SKIN_PATH = "/Hand/skin"


def link_axes(link: int) -> tuple[str, ...]:
    """The free axes of the joint above a link, in DOF order."""
    return LINEAR_AXES + ANGULAR_AXES if link == 0 else ANGULAR_AXES


def link_dofs(link: int) -> slice:
    """The DOFs of the joint above a link."""
    first_finger_dof = WRIST_DOF_COUNT + 3 * (link - 1)
    return slice(0, WRIST_DOF_COUNT) if link == 0 else slice(first_finger_dof, first_finger_dof + 3)


def write_hand(hand: HandModel) -> None:
    """Write the hand to ``hand.path``, whole or not at all."""
    save_stage(_hand_stage(hand), hand.path)


def _hand_stage(hand: HandModel) -> Usd.Stage:
    stage = new_stage("Hand", FORMAT, VERSION)
    root = stage.GetDefaultPrim()
    UsdPhysics.ArticulationRootAPI.Apply(root)
    root.AddAppliedSchema("NewtonArticulationRootAPI")
    set_attribute(root, "newton:selfCollisionEnabled", Sdf.ValueTypeNames.Bool, False)
    set_attribute(root, "artigrasp:name", Sdf.ValueTypeNames.String, hand.name)
    set_attribute(root, "artigrasp:side", Sdf.ValueTypeNames.Token, hand.side)

    base = UsdGeom.Xform.Define(stage, "/Hand/base").GetPrim()
    # Fixed to the world, so any mass will do; without one importers drop the body.
    set_mass(base, 1.0, np.zeros(3), 1e-3 * np.eye(3))
    UsdPhysics.FixedJoint.Define(stage, "/Hand/base_joint").CreateBody1Rel().SetTargets([base.GetPath()])

    for link, origin in enumerate(hand.link_origin):
        _write_link(stage, hand, link, origin)
        _write_joint(stage, hand, link)
    for finger, link, offset in zip(TIP_FINGERS, TIP_LINKS, hand.tip_offset, strict=True):
        _write_tip(stage, f"/Hand/{LINKS[link]}/{finger}_tip", offset)
    if hand.skin is not None:
        define_skin(stage, SKIN_PATH, hand.skin)
    return stage


def _write_link(stage: Usd.Stage, hand: HandModel, link: int, origin: Array) -> None:
    prim = UsdGeom.Xform.Define(stage, f"/Hand/{LINKS[link]}").GetPrim()
    set_pose(prim, origin)
    set_mass(prim, hand.link_mass[link], hand.link_com[link], hand.link_inertia[link])
    set_attribute(prim, "artigrasp:keypoint", Sdf.ValueTypeNames.Token, LINKS[link])
    set_attribute(prim, "artigrasp:contactLink", Sdf.ValueTypeNames.Int, link)
    for index, collider in enumerate(hand.colliders[link]):
        shape = _write_collider(stage, f"{prim.GetPath()}/collider_{index:02d}", collider)
        if hand.skin is not None:
            shape.CreatePurposeAttr(UsdGeom.Tokens.guide)


def _write_collider(stage: Usd.Stage, path: str, collider: Collider) -> UsdGeom.Gprim:
    if isinstance(collider, Capsule):
        shape = UsdGeom.Capsule.Define(stage, path)
        shape.CreateAxisAttr(UsdGeom.Tokens.z)
        shape.CreateRadiusAttr(float(collider.radius))
        shape.CreateHeightAttr(float(collider.length))
        half = collider.length / 2 + collider.radius
        corner = Gf.Vec3f(float(collider.radius), float(collider.radius), float(half))
    else:
        shape = UsdGeom.Cube.Define(stage, path)
        shape.CreateSizeAttr(1.0)
        corner = Gf.Vec3f(0.5)
    shape.CreateExtentAttr([-corner, corner])
    shape.CreateDisplayColorAttr([Gf.Vec3f(*SKIN_COLOUR)])
    set_pose(shape.GetPrim(), collider.position, collider.orientation)
    if isinstance(collider, Box):
        shape.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*vector(collider.extents)))
    UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
    return shape


def _write_joint(stage: Usd.Stage, hand: HandModel, link: int) -> None:
    parent = "base" if link == 0 else LINKS[LINK_PARENTS[link]]
    joint = UsdPhysics.Joint.Define(stage, f"/Hand/{LINKS[link]}_joint")
    joint.CreateBody0Rel().SetTargets([f"/Hand/{parent}"])
    joint.CreateBody1Rel().SetTargets([f"/Hand/{LINKS[link]}"])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*vector(hand.link_offset[link])))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot0Attr(Gf.Quatf(1.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))
    prim, dofs = joint.GetPrim(), link_dofs(link)
    for axis in LINEAR_AXES if link else ():
        locked = UsdPhysics.LimitAPI.Apply(prim, axis)
        locked.CreateLowAttr(1.0)
        locked.CreateHighAttr(-1.0)
    for axis, dof in zip(link_axes(link), range(DOF_COUNT)[dofs], strict=True):
        to_usd = np.degrees if axis in ANGULAR_AXES else float
        limit = UsdPhysics.LimitAPI.Apply(prim, axis)
        limit.CreateLowAttr(float(to_usd(hand.lower[dof])))
        limit.CreateHighAttr(float(to_usd(hand.upper[dof])))
        drive = UsdPhysics.DriveAPI.Apply(prim, axis)
        drive.CreateTypeAttr(UsdPhysics.Tokens.force)
        drive.CreateStiffnessAttr(0.0)
        drive.CreateDampingAttr(0.0)
        drive.CreateMaxForceAttr(float(hand.effort[dof]))
    damping, armature = hand.damping[dofs], hand.armature[dofs]
    set_attribute(prim, "artigrasp:damping", Sdf.ValueTypeNames.DoubleArray, vector(damping))
    set_attribute(prim, "artigrasp:armature", Sdf.ValueTypeNames.DoubleArray, vector(armature))
    if link and np.ptp(damping) == np.ptp(armature) == 0:
        prim.AddAppliedSchema("NewtonJointAPI")
        set_attribute(prim, "newton:damping", Sdf.ValueTypeNames.Float, float(np.radians(damping[0])))
        set_attribute(prim, "newton:armature", Sdf.ValueTypeNames.Float, float(armature[0]))


def _write_tip(stage: Usd.Stage, path: str, offset: Array) -> None:
    tip = UsdGeom.Sphere.Define(stage, path)
    tip.CreateRadiusAttr(0.002)
    tip.CreateExtentAttr([Gf.Vec3f(-0.002), Gf.Vec3f(0.002)])
    tip.CreatePurposeAttr(UsdGeom.Tokens.guide)
    set_pose(tip.GetPrim(), offset)
    tip.GetPrim().AddAppliedSchema("NewtonSiteAPI")
    set_attribute(tip.GetPrim(), "artigrasp:keypoint", Sdf.ValueTypeNames.Token, tip.GetPrim().GetName())


def read_hand(path: Path) -> HandModel:
    """Read a hand.

    Raises:
        UserError: the file is missing, is not a hand or lacks a part of one.
    """
    reader = StageReader(path, FORMAT, VERSION)
    root = reader.prim("/Hand")
    side = str(reader.value(root, "artigrasp:side"))
    if side not in HANDS:
        raise reader.error("/Hand.artigrasp:side", f"expected one of {', '.join(HANDS)}, found {side!r}")
    links = [reader.prim(f"/Hand/{link}") for link in LINKS]
    joints = [reader.prim(f"/Hand/{link}_joint") for link in LINKS]
    tips = [reader.prim(f"/Hand/{LINKS[link]}/{tip}_tip") for tip, link in zip(TIP_FINGERS, TIP_LINKS, strict=True)]
    mass, com, inertia = zip(*(reader.mass(link) for link in links), strict=True)

    def per_dof(attribute: str) -> Array:
        """An attribute of every joint axis, angles in radians."""
        return np.array(
            [
                reader.number(joint, attribute.format(axis=axis))
                for link, joint in enumerate(joints)
                for axis in link_axes(link)
            ]
        )

    angular = np.array([axis in ANGULAR_AXES for link in range(len(LINKS)) for axis in link_axes(link)])
    to_model = np.where(angular, np.radians(1.0), 1.0)
    hand = HandModel(
        name=str(reader.value(root, "artigrasp:name")),
        side=side,
        path=path,
        link_offset=np.stack([reader.array(joint, "physics:localPos0", (3,)) for joint in joints]),
        tip_offset=np.stack([reader.pose(tip)[0] for tip in tips]),
        lower=per_dof("limit:{axis}:physics:low") * to_model,
        upper=per_dof("limit:{axis}:physics:high") * to_model,
        damping=_per_joint(reader, joints, "artigrasp:damping"),
        armature=_per_joint(reader, joints, "artigrasp:armature"),
        effort=per_dof("drive:{axis}:physics:maxForce"),
        link_mass=np.array(mass),
        link_com=np.stack(com),
        link_inertia=np.stack(inertia),
        colliders=tuple(_read_colliders(reader, link) for link in links),
        skin=read_skin(reader, SKIN_PATH),
    )
    check_physics(path, reader.stage, _hand_stage(replace(hand, skin=None)))
    return hand


def _per_joint(reader: StageReader, joints: list[Usd.Prim], attribute: str) -> Array:
    return np.concatenate(
        [reader.array(joint, attribute, (len(link_axes(link)),)) for link, joint in enumerate(joints)]
    )


def _read_colliders(reader: StageReader, link: Usd.Prim) -> tuple[Collider, ...]:
    colliders: list[Collider] = []
    for prim in link.GetChildren():
        if not prim.HasAPI(UsdPhysics.CollisionAPI):
            continue
        position, orientation = reader.pose(prim)
        if prim.IsA(UsdGeom.Capsule):
            radius, length = reader.number(prim, "radius"), reader.number(prim, "height")
            colliders.append(Capsule(position, orientation, radius, length))
        elif prim.IsA(UsdGeom.Cube):
            extents = reader.number(prim, "size") * reader.array(prim, "xformOp:scale", (3,))
            colliders.append(Box(position, orientation, extents))
        else:
            raise reader.error(str(prim.GetPath()), f"expected a Capsule or a Cube, found a {prim.GetTypeName()}")
    return tuple(colliders)
