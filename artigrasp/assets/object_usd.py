"""Hinged objects as USD files that Newton's own importer reads, and back to numbers.

``/Object`` is the articulation, ``base`` and ``articulated`` are its bodies, each with a ``visual`` mesh and convex
``pieces`` for collisions, and ``hinge`` joins them. No joint holds the base to the world: a scene fixes it or leaves it
free.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from artigrasp.arrays import Array
from artigrasp.assets.object_model import FARTHEST, Indices, Mesh, ObjectModel, PartModel
from artigrasp.assets.usd_physics import check_physics
from artigrasp.assets.usd_stage import StageReader, new_stage, save_stage, set_attribute, set_mass, vector
from artigrasp.kernels.layout import PARTS

FORMAT, VERSION = "artigrasp.object", 2
"""Since version 2 each face of a visual mesh may have a colour of its own."""


def write_object(model: ObjectModel) -> None:
    """Write the object to ``model.path``, whole or not at all."""
    save_stage(_object_stage(model), model.path)


def _object_stage(model: ObjectModel) -> Usd.Stage:
    stage = new_stage("Object", FORMAT, VERSION)
    root = stage.GetDefaultPrim()
    UsdPhysics.ArticulationRootAPI.Apply(root)
    set_attribute(root, "artigrasp:name", Sdf.ValueTypeNames.String, model.name)
    for name, part in zip(PARTS, model.parts, strict=True):
        body = UsdGeom.Xform.Define(stage, f"/Object/{name}").GetPrim()
        set_mass(body, part.mass, part.com, part.inertia)
        visual = _write_mesh(stage, f"/Object/{name}/visual", Mesh(part.vertices, part.faces))
        _write_colours(visual, part.colours)
        UsdGeom.Scope.Define(stage, f"/Object/{name}/pieces")
        for index, piece in enumerate(part.pieces):
            mesh = _write_mesh(stage, f"/Object/{name}/pieces/piece_{index:02d}", piece)
            mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)
            UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
            approximation = UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim())
            approximation.CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    write_hinge(stage, "/Object", model)
    return stage


def _write_mesh(stage: Usd.Stage, path: str, mesh: Mesh) -> UsdGeom.Mesh:
    prim = UsdGeom.Mesh.Define(stage, path)
    points = [Gf.Vec3f(*vector(vertex)) for vertex in mesh.vertices]
    prim.CreatePointsAttr(points)
    prim.CreateFaceVertexCountsAttr([3] * len(mesh.faces))
    prim.CreateFaceVertexIndicesAttr(mesh.faces.ravel().tolist())
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(prim, Usd.TimeCode.Default()))
    return prim


def _write_colours(visual: UsdGeom.Mesh, colours: Array) -> None:
    """Write a palette, and for each face its place in it where there is more than one colour."""
    palette, index = np.unique(colours, axis=0, return_inverse=True)
    primvar = visual.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform if len(palette) > 1 else UsdGeom.Tokens.constant)
    primvar.Set([Gf.Vec3f(*vector(colour)) for colour in palette])
    if len(palette) > 1:
        primvar.SetIndices(index.ravel().tolist())


def write_hinge(stage: Usd.Stage, root: str, model: ObjectModel) -> None:
    """Join the two parts below the prim ``root`` by the prim ``hinge`` beside them."""
    joint = UsdPhysics.RevoluteJoint.Define(stage, f"{root}/hinge")
    joint.CreateBody0Rel().SetTargets([f"{root}/{PARTS[0]}"])
    joint.CreateBody1Rel().SetTargets([f"{root}/{PARTS[1]}"])
    joint.CreateAxisAttr(UsdGeom.Tokens.z)
    x, y, z, w = vector(_turn_z_to(model.hinge_axis))
    origin = Gf.Vec3f(*vector(model.hinge_origin))
    joint.CreateLocalPos0Attr(origin)
    joint.CreateLocalPos1Attr(origin)
    joint.CreateLocalRot0Attr(Gf.Quatf(w, x, y, z))
    joint.CreateLocalRot1Attr(Gf.Quatf(w, x, y, z))
    joint.CreateLowerLimitAttr(float(np.degrees(model.hinge_lower)))
    joint.CreateUpperLimitAttr(float(np.degrees(model.hinge_upper)))
    prim = joint.GetPrim()
    prim.AddAppliedSchema("NewtonJointAPI")
    set_attribute(prim, "newton:damping", Sdf.ValueTypeNames.Float, float(np.radians(model.hinge_damping)))
    set_attribute(prim, "newton:friction", Sdf.ValueTypeNames.Float, float(model.hinge_friction))


def _turn_z_to(axis: Array) -> Array:
    """The shortest rotation from +z to a unit vector, xyzw."""
    half_way = np.array([0.0, 0.0, 1.0]) + axis
    if np.linalg.norm(half_way) < 1e-6:
        return np.array([1.0, 0.0, 0.0, 0.0])
    half_way /= np.linalg.norm(half_way)
    return np.array([-half_way[1], half_way[0], 0.0, half_way[2]])


def read_object(path: Path) -> ObjectModel:
    """Read an object.

    Raises:
        UserError: the file is missing, is not an object or lacks a part of one.
    """
    reader = StageReader(path, FORMAT, VERSION)
    hinge = reader.prim("/Object/hinge")
    base, articulated = (_read_part(reader, name) for name in PARTS)
    model = ObjectModel(
        name=str(reader.value(reader.prim("/Object"), "artigrasp:name")),
        path=path,
        parts=(base, articulated),
        hinge_origin=reader.array(hinge, "physics:localPos0", (3,)),
        hinge_axis=reader.rotation(hinge, "physics:localRot0").apply([0.0, 0.0, 1.0]),
        hinge_lower=float(np.radians(reader.number(hinge, "physics:lowerLimit"))),
        hinge_upper=float(np.radians(reader.number(hinge, "physics:upperLimit"))),
        hinge_damping=float(np.degrees(reader.number(hinge, "newton:damping"))),
        hinge_friction=reader.number(hinge, "newton:friction"),
    )
    bare = replace(model, parts=(_without_meshes(base), _without_meshes(articulated)))
    check_physics(path, reader.stage, _object_stage(bare))
    return model


def _without_meshes(part: PartModel) -> PartModel:
    """What meshes are made of is read, and no importer's business."""
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    pieces = (nothing,) * len(part.pieces)
    return replace(part, vertices=nothing.vertices, faces=nothing.faces, pieces=pieces)


def _read_part(reader: StageReader, name: str) -> PartModel:
    mass, com, inertia = reader.mass(reader.prim(f"/Object/{name}"))
    visual = reader.prim(f"/Object/{name}/visual")
    mesh = _read_mesh(reader, visual)
    pieces = reader.prim(f"/Object/{name}/pieces").GetChildren()
    return PartModel(
        mass=mass,
        com=com,
        inertia=inertia,
        vertices=mesh.vertices,
        faces=mesh.faces,
        pieces=tuple(_read_mesh(reader, piece) for piece in pieces),
        colours=_read_colours(reader, visual, len(mesh.faces)),
    )


def _read_colours(reader: StageReader, visual: Usd.Prim, face_count: int) -> Array:
    palette = reader.array(visual, "primvars:displayColor", (-1, 3))
    name = "primvars:displayColor:indices"
    if visual.GetAttribute(name).HasAuthoredValue():
        index = reader.array(visual, name, (face_count,)).astype(np.int64)
    else:
        index = np.arange(face_count) if len(palette) == face_count else np.zeros(face_count, np.int64)
    if not (len(palette) and (index >= 0).all() and (index < len(palette)).all()):
        raise reader.error(f"{visual.GetPath()}.primvars:displayColor", "expected one colour, or one for each face")
    return palette[index]


def _read_mesh(reader: StageReader, prim: Usd.Prim) -> Mesh:
    vertices = reader.array(prim, "points", (-1, 3))
    if (np.abs(vertices) > FARTHEST).any():
        raise reader.error(f"{prim.GetPath()}.points", f"expected points within {FARTHEST:g} m, found some beyond")
    counts = reader.array(prim, "faceVertexCounts", (-1,))
    if (counts != 3).any():
        raise reader.error(f"{prim.GetPath()}.faceVertexCounts", "expected triangles only")
    indices: Array = reader.array(prim, "faceVertexIndices", (3 * len(counts),))
    faces: Indices = indices.astype(np.int64).reshape(-1, 3)
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise reader.error(f"{prim.GetPath()}.faceVertexIndices", f"expected indices below {len(vertices)}")
    return Mesh(vertices, faces)
