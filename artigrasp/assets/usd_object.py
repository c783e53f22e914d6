"""Hinged objects in USD that others authored: two rigid bodies with meshes, and a revolute joint between them."""

from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdPhysics, Vt
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.arrays import Array
from artigrasp.assets.foreign_stage import foreign_stage
from artigrasp.assets.imported_object import (
    ImportedObject,
    ImportedPart,
    closed_angle,
    moved,
    revolute_pose,
)
from artigrasp.assets.object_model import Colour, Mesh
from artigrasp.errors import UserError

_UPRIGHT = {UsdGeom.Tokens.z: Rotation.identity(), UsdGeom.Tokens.y: Rotation.from_euler("x", 90, degrees=True)}
"""From a stage's axes to ours, of which Z is up."""


def read_usd_object(path: Path, root: Path | None = None) -> ImportedObject:
    """Read an object; masses are not taken over, but made of the shapes.

    Args:
        path: The file.
        root: Folder that holds everything that it may refer to, by default its own.

    Raises:
        UserError: it is no USD, refers to files outside the folder, or is no object of two bodies on one hinge; says
            what was found.
    """
    with foreign_stage(path, root) as stage:
        return _read_stage(stage, path)


def _read_stage(stage: Usd.Stage, path: Path) -> ImportedObject:
    unit, up = UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)
    if up not in _UPRIGHT or not 0 < unit < np.inf:
        raise UserError(f"{path}: expected y or z up, and a positive unit of length, found {up} and {unit} m")
    hinges = [prim for prim in stage.Traverse() if prim.IsA(UsdPhysics.RevoluteJoint)]
    if len(hinges) != 1:
        found = ", ".join(str(prim.GetPath()) for prim in hinges) or "none"
        raise UserError(f"{path}: joints: expected one PhysicsRevoluteJoint, the hinge, found {found}")
    hinge = UsdPhysics.RevoluteJoint(hinges[0])
    bodies = [_body(stage, path, hinges[0], end) for end in ("body0", "body1")]
    frames = [_joint_frame(hinge, end, path) for end in (0, 1)]
    limits = hinge.GetLowerLimitAttr().Get(), hinge.GetUpperLimitAttr().Get()
    if not all(limit is not None and np.isfinite(limit) for limit in limits) or not limits[0] < limits[1]:
        raise UserError(
            f"{path}: {hinges[0].GetPath()}: expected a lower and an upper limit in degrees, found {limits}"
        )
    lower, upper = np.radians(limits)
    closed, sign = closed_angle(lower, upper)
    name = hinge.GetAxisAttr().Get() or "X"
    if name not in tuple("XYZ"):
        raise UserError(f"{path}: {hinges[0].GetPath()}.physics:axis: expected X, Y or Z, found {name}")
    axis: Array = np.eye(3)["XYZ".index(name)]
    # How the base stands in the stage, which says what is up; its place does not matter.
    standing = _UPRIGHT[up] * _world_pose(bodies[0], path).rotation
    to_base = RigidTransform.from_rotation(standing)
    from_articulated = frames[0] * revolute_pose(np.zeros(3), axis, closed) * frames[1].inv()
    poses = to_base, to_base * _scaled(from_articulated, unit)
    base, articulated = (_read_part(body, pose, unit, path) for body, pose in zip(bodies, poses, strict=True))
    at_hinge = to_base * _scaled(frames[0], unit)
    return ImportedObject(
        path=path,
        parts=(base, articulated),
        hinge_origin=at_hinge.translation,
        hinge_axis=sign * at_hinge.rotation.apply(axis),
        hinge_upper=float(upper - lower),
        hinge_damping=0.0,
        hinge_friction=0.0,
    )


def _body(stage: Usd.Stage, path: Path, hinge: Usd.Prim, end: str) -> Usd.Prim:
    targets = hinge.GetRelationship(f"physics:{end}").GetTargets()
    prim = stage.GetPrimAtPath(targets[0]) if len(targets) == 1 else None
    if not prim:
        raise UserError(f"{path}: {hinge.GetPath()}.physics:{end}: expected one rigid body, found {len(targets)}")
    return prim


def _joint_frame(joint: UsdPhysics.RevoluteJoint, end: int, path: Path) -> RigidTransform:
    """The joint's frame in one of its bodies, in units of the stage."""
    position = (joint.GetLocalPos0Attr() if end == 0 else joint.GetLocalPos1Attr()).Get() or Gf.Vec3f(0)
    turn = (joint.GetLocalRot0Attr() if end == 0 else joint.GetLocalRot1Attr()).Get() or Gf.Quatf(1)
    return _rigid(position, turn, joint.GetPrim(), path)


def _world_pose(prim: Usd.Prim, path: Path) -> RigidTransform:
    matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()).RemoveScaleShear()
    return _rigid(matrix.ExtractTranslation(), matrix.ExtractRotationQuat(), prim, path)


def _rigid(position: Gf.Vec3f | Gf.Vec3d, turn: Gf.Quatf | Gf.Quatd, prim: Usd.Prim, path: Path) -> RigidTransform:
    """Position and orientation of a prim of a file.

    Raises:
        UserError: They are none.
    """
    numbers = np.array([*position, *turn.GetImaginary(), turn.GetReal()], float)
    if not np.isfinite(numbers).all() or not np.linalg.norm(numbers[3:]) > 1e-6:
        found = f"{position} and {turn}"
        raise UserError(f"{path}: {prim.GetPath()}: expected a position and an orientation, found {found}")
    return RigidTransform.from_components(numbers[:3], Rotation.from_quat(numbers[3:]))


def _scaled(pose: RigidTransform, unit: float) -> RigidTransform:
    return RigidTransform.from_components(unit * pose.translation, pose.rotation)


def _read_part(body: Usd.Prim, pose: RigidTransform, unit: float, path: Path) -> ImportedPart:
    """The meshes below a body: those with a collision schema collide, others and those that are no guides are seen."""
    in_body = _world_pose(body, path).inv()
    shown: list[tuple[Mesh, Colour | None]] = []
    solid: list[Mesh] = []
    for prim in Usd.PrimRange(body, Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Mesh):
            continue
        read = _read_mesh(prim, path)
        mesh = moved(Mesh(unit * in_body.apply(read.vertices), read.faces), pose)
        if prim.HasAPI(UsdPhysics.CollisionAPI):
            solid.append(mesh)
        if UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
            shown.append((mesh, _colour(prim)))
    if not shown and not solid:
        raise UserError(f"{path}: {body.GetPath()}: expected meshes below it, found none")
    return ImportedPart(tuple(shown or [(mesh, None) for mesh in solid]), tuple(solid), None)


def _read_mesh(prim: Usd.Prim, path: Path) -> Mesh:
    """A mesh in the world, in units of the stage; its faces cut into triangles."""
    mesh = UsdGeom.Mesh(prim)
    attributes = mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
    values, kinds = [attribute.Get() for attribute in attributes], (Vt.Vec3fArray, Vt.IntArray, Vt.IntArray)
    if not all(isinstance(value, kind) for value, kind in zip(values, kinds, strict=True)):
        raise UserError(f"{path}: {prim.GetPath()}: expected points and faces of them")
    points, counts, corners = np.array(values[0], float), np.array(values[1], int), np.array(values[2], int)
    if (
        not np.isfinite(points).all()
        or not len(counts)
        or counts.min() < 3
        or counts.sum() != len(corners)
        or not 0 <= corners.min() <= corners.max() < len(points)
    ):
        raise UserError(f"{path}: {prim.GetPath()}: expected points and faces of them")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        (corners[start], corners[start + at], corners[start + at + 1])
        for start, count in zip(starts, counts, strict=True)
        for at in range(1, count - 1)
    ]
    matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    left_handed = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    indices = np.array(faces, np.int64)[:, :: -1 if mirrored != left_handed else 1]
    return Mesh(points @ matrix[:3, :3] + matrix[3, :3], indices)


def _colour(prim: Usd.Prim) -> Colour | None:
    colours = UsdGeom.Mesh(prim).GetDisplayColorAttr().Get()
    if not colours:
        return None
    red, green, blue = np.mean(np.array(colours, float), axis=0).tolist()
    return red, green, blue
