"""Hands in a USD animation: in a skin that programs bend, in one that is bent already, or as rigid links."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_skin import SKIN_COLOUR, HandSkin
from artigrasp.assets.skin_usd import JOINT_PATHS, add_skin_mesh, define_skin
from artigrasp.assets.usd_stage import set_pose
from artigrasp.export.bodies import Body
from artigrasp.export.hand_surface import skin_of
from artigrasp.export.surface import link_surface
from artigrasp.export.usd_prims import SKIN, add_body, add_ghost, add_surface, bind, continuous, haunt
from artigrasp.kernels.layout import LINK_COUNT, LINK_PARENTS, LINKS

HandLook = Literal["skinned", "baked", "links"]
HAND_LOOKS: tuple[HandLook, ...] = get_args(HandLook)


def add_hand(
    stage: Usd.Stage, path: str, hand: HandModel, links: Sequence[Body], look: HandLook, codes: Sequence[float]
) -> None:
    """Add a hand that moves.

    Args:
        stage: To add it to.
        path: Of the new prim.
        hand: The hand.
        links: Its links and where they are in T samples.
        look: ``"skinned"`` is a UsdSkel character, ``"baked"`` a mesh whose points move, for programs that know no
            UsdSkel, ``"links"`` a rigid body for each link.
        codes: Time codes of the samples.
    """
    if look == "links":
        UsdGeom.Xform.Define(stage, path)
        for link in links:
            add_body(stage, f"{path}/{link.name}", link, codes)
        return
    skin, poses = skin_of(hand), np.stack([link.poses for link in links], axis=1)
    if look == "skinned":
        _add_character(stage, path, skin, poses, codes)
        return
    UsdGeom.Xform.Define(stage, path)
    mesh = add_skin_mesh(stage, f"{path}/surface", skin)
    bind(stage, mesh.GetPrim(), SKIN, np.array(SKIN_COLOUR))
    for code, pose in zip(codes, poses, strict=True):
        points = Vt.Vec3fArray.FromNumpy(skin.posed(pose).astype(np.float32))
        mesh.GetPointsAttr().Set(points, code)
        mesh.GetExtentAttr().Set(UsdGeom.PointBased.ComputeExtent(points), code)


def add_hand_ghost(stage: Usd.Stage, path: str, hand: HandModel, poses: NDArray[np.float32], look: HandLook) -> None:
    """Add a hand that is still, its links at these poses, shape ``[16, 7]``, as a ghost."""
    ghost = add_ghost(stage, path)
    if look != "links":
        mesh = add_skin_mesh(stage, f"{path}/surface", skin_of(hand))
        points = Vt.Vec3fArray.FromNumpy(skin_of(hand).posed(poses).astype(np.float32))
        mesh.GetPointsAttr().Set(points)
        mesh.GetExtentAttr().Set(UsdGeom.PointBased.ComputeExtent(points))
        haunt(stage, mesh)
        return
    for link, name in enumerate(LINKS):
        xform = UsdGeom.Xform.Define(stage, f"{ghost.GetPath()}/{name}")
        set_pose(xform.GetPrim(), poses[link, :3], poses[link, 3:])
        haunt(stage, add_surface(stage, f"{xform.GetPath()}/visual", link_surface(hand, link)))


def _add_character(
    stage: Usd.Stage, path: str, skin: HandSkin, poses: NDArray[np.float32], codes: Sequence[float]
) -> None:
    """Add a hand as a UsdSkel character, animated by the poses of its links, shape ``[T, 16, 7]``."""
    skeleton, mesh = define_skin(stage, path, skin)
    bind(stage, mesh.GetPrim(), SKIN, np.array(SKIN_COLOUR))
    animation = UsdSkel.Animation.Define(stage, f"{skeleton.GetPath()}/animation")
    animation.CreateJointsAttr(JOINT_PATHS)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    animation.CreateScalesAttr(Vt.Vec3hArray(LINK_COUNT, Gf.Vec3h(1.0)))
    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    extent = UsdGeom.Boundable(stage.GetPrimAtPath(path)).CreateExtentAttr()
    positions, turns = _in_parents(poses)
    for code, position, turn, pose in zip(codes, positions, turns, poses, strict=True):
        translations.Set(Vt.Vec3fArray.FromNumpy(position.astype(np.float32)), code)
        rotations.Set(Vt.QuatfArray([Gf.Quatf(w, x, y, z) for x, y, z, w in turn.tolist()]), code)
        points = Vt.Vec3fArray.FromNumpy(skin.posed(pose).astype(np.float32))
        extent.Set(UsdGeom.PointBased.ComputeExtent(points), code)


def _in_parents(poses: NDArray[np.float32]) -> tuple[Array, Array]:
    """Positions [m] and quaternions (xyzw) of links in the frames of their parents, of the wrist in the world.

    Of q and -q it is always the one nearer to the sample before: interpolation goes the short way.

    Args:
        poses: Of the links in the world, shape ``[T, 16, 7]``.
    """
    positions, turns = np.array(poses[..., :3], np.float64), np.array(poses[..., 3:], np.float64)
    for link in range(1, LINK_COUNT):
        parent = LINK_PARENTS[link]
        back = Rotation.from_quat(poses[:, parent, 3:]).inv()
        positions[:, link] = back.apply(poses[:, link, :3].astype(np.float64) - poses[:, parent, :3])
        turns[:, link] = (back * Rotation.from_quat(poses[:, link, 3:])).as_quat()
    return positions, continuous(turns)
