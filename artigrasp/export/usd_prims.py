"""What USD animations are made of: meshes with materials, bodies that move, ghosts."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from artigrasp.arrays import Array
from artigrasp.assets.object_model import Colour
from artigrasp.export.bodies import Body
from artigrasp.export.surface import Surface

MATERIALS = "/World/Materials"
SKIN, GHOST = "Skin", "Ghost"
"""Materials that are no paint."""
GHOST_COLOUR: Colour = (0.30, 0.62, 0.42)
GHOST_OPACITY = 0.35
ROUGHNESS = 0.55

T = TypeVar("T", bound=np.floating)


def add_body(stage: Usd.Stage, path: str, body: Body, codes: Sequence[float]) -> Usd.Prim:
    """Add a body with its surface, moving through the time codes."""
    xform = UsdGeom.Xform.Define(stage, path)
    # Double precision: USD takes the angle of a rotation from the arc cosine of w, which turns the rounding of a float
    # near one into a third of a milliradian.
    double = UsdGeom.XformOp.PrecisionDouble
    translate, orient = xform.AddTranslateOp(double), xform.AddOrientOp(double)
    turns = continuous(body.poses[:, 3:])
    for code, (x, y, z), (qx, qy, qz, qw) in zip(codes, body.poses[:, :3].tolist(), turns.tolist(), strict=True):
        translate.Set(Gf.Vec3d(x, y, z), code)
        orient.Set(Gf.Quatd(qw, qx, qy, qz).GetNormalized(), code)
    paint(stage, add_surface(stage, f"{path}/visual", body.surface), body.colours)
    return xform.GetPrim()


def continuous(quaternions: NDArray[T]) -> NDArray[T]:
    """Of q and -q always the one nearer to the sample before: interpolation goes the short way.

    Args:
        quaternions: Of T samples, shape ``[T, ..., 4]``.
    """
    turns = quaternions.copy()
    flips = np.sum(turns[1:] * turns[:-1], axis=-1) < 0
    turns[1:] *= np.where(np.cumsum(flips, axis=0) % 2, -1, 1)[..., None]
    return turns


def add_ghost(stage: Usd.Stage, path: str) -> Usd.Prim:
    """Add a prim below which all is shown only together with guides."""
    xform = UsdGeom.Xform.Define(stage, path)
    xform.CreatePurposeAttr(UsdGeom.Tokens.guide)
    return xform.GetPrim()


def add_surface(stage: Usd.Stage, path: str, surface: Surface) -> UsdGeom.Mesh:
    """Add a mesh without a material."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(surface.vertices.astype(np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(surface.faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(surface.faces.astype(np.int32).ravel()))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(surface.corner_normals.astype(np.float32).reshape(-1, 3)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    return mesh


def paint(stage: Usd.Stage, mesh: UsdGeom.Mesh, colours: ArrayLike) -> None:
    """Give a mesh one linear colour, or one for each face, shape ``[F, 3]``: a material for each that there is."""
    face_count = len(mesh.GetFaceVertexCountsAttr().Get())
    palette, index = np.unique(np.broadcast_to(colours, (face_count, 3)), axis=0, return_inverse=True)
    shown = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform if len(palette) > 1 else UsdGeom.Tokens.constant)
    shown.Set(Vt.Vec3fArray.FromNumpy(palette.astype(np.float32)))
    if len(palette) == 1:
        bind(stage, mesh.GetPrim(), _paint_name(palette[0]), palette[0])
        return
    shown.SetIndices(Vt.IntArray.FromNumpy(index.ravel().astype(np.int32)))
    for number, colour in enumerate(palette):
        faces = Vt.IntArray.FromNumpy(np.flatnonzero(index == number).astype(np.int32))
        subset = UsdShade.MaterialBindingAPI(mesh).CreateMaterialBindSubset(f"colour_{number:02d}", faces)
        bind(stage, subset.GetPrim(), _paint_name(colour), colour)


def haunt(stage: Usd.Stage, mesh: UsdGeom.Mesh) -> None:
    """Give a mesh the look of a ghost."""
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*GHOST_COLOUR)])
    bind(stage, mesh.GetPrim(), GHOST, np.array(GHOST_COLOUR))


def bind(stage: Usd.Stage, prim: Usd.Prim, name: str, colour: Array) -> None:
    """Bind the material of this name, which the first that needs it makes.

    ``SKIN`` takes its colour from the vertices where a program can; ``GHOST`` is seen through.
    """
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(_material(stage, name, Gf.Vec3f(*colour.tolist())))


def _paint_name(colour: Array) -> str:
    return "Paint_" + "".join(f"{round(255 * value):02x}" for value in colour)


def _material(stage: Usd.Stage, name: str, colour: Gf.Vec3f) -> UsdShade.Material:
    UsdGeom.Scope.Define(stage, MATERIALS)
    path = f"{MATERIALS}/{name}"
    if stage.GetPrimAtPath(path):
        return UsdShade.Material.Get(stage, path)
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    diffuse = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    diffuse.Set(colour)
    if name == SKIN:
        reader = UsdShade.Shader.Define(stage, f"{path}/Colour")
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
        reader.CreateInput("fallback", Sdf.ValueTypeNames.Float3).Set(colour)
        diffuse.ConnectToSource(reader.CreateOutput("result", Sdf.ValueTypeNames.Float3))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(GHOST_OPACITY if name == GHOST else 1.0)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), UsdShade.Tokens.surface)
    return material
