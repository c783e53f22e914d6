"""Hinged objects as others author them."""

from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdPhysics

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></visual></link>"""
HINGE = """<joint name="hinge" type="{type}"><parent link="case"/><child link="lid"/>
<origin xyz="0 .1 .1" rpy="0 0 1.5707963267948966"/><axis xyz="{axis}"/>
<limit lower="{lower}" upper="{upper}"/></joint>"""


def foreign_urdf(
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
