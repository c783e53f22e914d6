"""The skin of a hand as a UsdSkel character.

``root`` is the ``SkelRoot``; below it ``skeleton`` has the 16 links as joints, bound in the hand's zero pose, and
``surface`` is the mesh with its weights. The surface is to be refined by Loop's rule.
"""

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from artigrasp.arrays import Array
from artigrasp.assets.hand_skin import HandSkin
from artigrasp.assets.usd_stage import StageReader
from artigrasp.kernels.layout import LINK_COUNT, LINK_PARENTS, LINKS

POSITION_DIGITS, WEIGHT_DIGITS, COLOUR_DIGITS = 6, 3, 3
"""After the decimal point, of what is stored: micrometres, and thousandths."""
INFLUENCES = 4
"""Links that a vertex follows, at most."""


def _joint_path(link: int) -> str:
    parent = LINK_PARENTS[link]
    return LINKS[link] if parent < 0 else f"{_joint_path(parent)}/{LINKS[link]}"


JOINT_PATHS = tuple(_joint_path(link) for link in range(LINK_COUNT))
"""The links as UsdSkel names joints: each after its ancestors."""


def define_skin(stage: Usd.Stage, root: str, skin: HandSkin) -> tuple[UsdSkel.Skeleton, UsdGeom.Mesh]:
    """Add a skin below a new ``SkelRoot``.

    Args:
        stage: To add it to.
        root: Path of the ``SkelRoot``.
        skin: The skin, whose vertices follow at most ``INFLUENCES`` links.
    """
    UsdSkel.Root.Define(stage, root)
    skeleton = UsdSkel.Skeleton.Define(stage, f"{root}/skeleton")
    skeleton.CreateJointsAttr(JOINT_PATHS)
    offsets = skin.link_origin - skin.link_origin[[max(parent, 0) for parent in LINK_PARENTS]]
    offsets[0] = skin.link_origin[0]
    skeleton.CreateBindTransformsAttr(_translations(skin.link_origin))
    skeleton.CreateRestTransformsAttr(_translations(offsets))
    # Only the surface is to be seen.
    skeleton.CreatePurposeAttr(UsdGeom.Tokens.guide)
    mesh = add_skin_mesh(stage, f"{root}/surface", skin)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    joints = np.argsort(-skin.weights, axis=1, kind="stable")[:, :INFLUENCES]
    weights = np.take_along_axis(skin.weights, joints, axis=1)
    joints = np.where(weights > 0, joints, 0)
    binding.CreateJointIndicesPrimvar(constant=False, elementSize=INFLUENCES).Set(
        Vt.IntArray.FromNumpy(joints.astype(np.int32).ravel())
    )
    binding.CreateJointWeightsPrimvar(constant=False, elementSize=INFLUENCES).Set(
        Vt.FloatArray.FromNumpy(weights.astype(np.float32).ravel())
    )
    return skeleton, mesh


def add_skin_mesh(stage: Usd.Stage, path: str, skin: HandSkin) -> UsdGeom.Mesh:
    """Add the surface of a skin in the zero pose, which nothing bends."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = Vt.Vec3fArray.FromNumpy(np.round(skin.vertices, POSITION_DIGITS).astype(np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(skin.faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(skin.faces.astype(np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.loop)
    colours = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
    colours.Set(Vt.Vec3fArray.FromNumpy(np.round(skin.colours, COLOUR_DIGITS).astype(np.float32)))
    return mesh


def read_skin(reader: StageReader, root: str) -> HandSkin | None:
    """Read a skin; None if there is none.

    Raises:
        UserError: it is malformed.
    """
    if not reader.stage.GetPrimAtPath(root):
        return None
    skeleton, mesh = reader.prim(f"{root}/skeleton"), reader.prim(f"{root}/surface")
    joints = reader.value(skeleton, "joints")
    if not isinstance(joints, Vt.TokenArray) or tuple(joints) != JOINT_PATHS:
        raise reader.error(f"{root}/skeleton.joints", f"expected {', '.join(JOINT_PATHS)}, found {joints}")
    transforms = reader.value(skeleton, "bindTransforms")
    if not isinstance(transforms, Vt.Matrix4dArray) or len(transforms) != LINK_COUNT:
        raise reader.error(f"{root}/skeleton.bindTransforms", f"expected {LINK_COUNT} matrices")
    vertices = reader.array(mesh, "points", (-1, 3))
    count, counts = len(vertices), reader.array(mesh, "faceVertexCounts", (-1,))
    if not len(counts) or (counts != 3).any():
        raise reader.error(f"{root}/surface.faceVertexCounts", "expected triangles")
    faces = reader.array(mesh, "faceVertexIndices", (3 * len(counts),)).astype(np.int32).reshape(-1, 3)
    indices = reader.array(mesh, "primvars:skel:jointIndices", (count * INFLUENCES,)).astype(np.int64)
    for name, index, size in (("faceVertexIndices", faces, count), ("primvars:skel:jointIndices", indices, LINK_COUNT)):
        if not ((index >= 0) & (index < size)).all():
            found = f"{index.min()} to {index.max()}"
            raise reader.error(f"{root}/surface.{name}", f"expected 0 to {size - 1}, found {found}")
    held = reader.array(mesh, "primvars:skel:jointWeights", (count * INFLUENCES,))
    weights = np.zeros((count, LINK_COUNT))
    np.add.at(weights, (np.repeat(np.arange(count), INFLUENCES), indices), held)
    if not (held.min() >= 0 and weights.sum(axis=1).min() > 0):
        raise reader.error(f"{root}/surface.primvars:skel:jointWeights", "expected weights that add up to 1")
    return HandSkin(
        vertices=vertices,
        faces=faces,
        weights=weights / weights.sum(axis=1, keepdims=True),
        colours=reader.array(mesh, "primvars:displayColor", (count, 3)),
        link_origin=np.array([each.ExtractTranslation() for each in transforms]),
    )


def _translations(positions: Array) -> Vt.Matrix4dArray:
    return Vt.Matrix4dArray([Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*position)) for position in positions.tolist()])
