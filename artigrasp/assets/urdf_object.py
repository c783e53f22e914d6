"""Hinged objects in URDF: one joint that turns, links that fixed joints make one with either side of it."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform

from artigrasp.arrays import Array
from artigrasp.assets.imported_object import (
    ImportedObject,
    ImportedPart,
    closed_angle,
    load_mesh,
    mesh_of,
    moved,
    moved_body,
    revolute_pose,
)
from artigrasp.assets.mass import Body, join_bodies
from artigrasp.assets.object_model import Colour, Mesh
from artigrasp.assets.urdf import Urdf, read_urdf
from artigrasp.files import check_inside

_ROUND_SECTIONS = 24
"""Sides of a cylinder."""


@dataclass(frozen=True)
class _Joint:
    """A joint: its element, the names of the links that it joins, and whether it is fixed."""

    element: ElementTree.Element
    parent: str
    child: str
    fixed: bool

    @property
    def name(self) -> str:
        return self.element.get("name", "")


def read_urdf_object(path: Path, root: Path | None = None) -> ImportedObject:
    """Read an object.

    Args:
        path: The file.
        root: Folder that holds all its meshes, by default its own.

    Raises:
        UserError: the file is malformed, refers to meshes outside the folder, or it is no object of two parts on one
            hinge; says what was found.
    """
    root = path.parent if root is None else root
    urdf = read_urdf(path)
    joints = [_read_joint(urdf, element) for element in urdf.root.findall("joint")]
    hinge = _find_hinge(urdf, joints)
    limit = urdf.child(hinge.element, "limit")
    closed, sign = closed_angle(urdf.number(limit, "lower"), urdf.number(limit, "upper"))
    if not urdf.number(limit, "lower") < urdf.number(limit, "upper"):
        raise urdf.error(f"joint {hinge.name} limit", "expected a lower limit below the upper one")
    axis = _axis(urdf, hinge.element)
    poses = _link_poses(urdf, joints, hinge, axis, closed)
    below = _links_below(joints, hinge.child)
    base, articulated = (
        _read_part(urdf, root, {name: pose for name, pose in poses.items() if (name in below) == is_below})
        for is_below in (False, True)
    )
    at_hinge = poses[hinge.parent] * _pose(urdf, hinge.element)
    dynamics = hinge.element.find("dynamics")
    damping, friction = (
        urdf.number(dynamics, name) if dynamics is not None and dynamics.get(name) else 0.0
        for name in ("damping", "friction")
    )
    return ImportedObject(
        path=path,
        parts=(base, articulated),
        hinge_origin=at_hinge.translation,
        hinge_axis=sign * at_hinge.rotation.apply(axis),
        hinge_upper=urdf.number(limit, "upper") - urdf.number(limit, "lower"),
        hinge_damping=damping,
        hinge_friction=friction,
    )


def _read_joint(urdf: Urdf, element: ElementTree.Element) -> _Joint:
    parent, child = (urdf.child(element, end).get("link", "") for end in ("parent", "child"))
    for name in (parent, child):
        urdf.link(name)
    return _Joint(element, parent, child, element.get("type") == "fixed")


def _find_hinge(urdf: Urdf, joints: list[_Joint]) -> _Joint:
    turning = [joint for joint in joints if not joint.fixed]
    if len(turning) != 1:
        found = ", ".join(f"{joint.name} ({joint.element.get('type')})" for joint in turning) or "none"
        raise urdf.error("joints", f"expected one that is not fixed, the hinge, found {found}; fix the others")
    if turning[0].element.get("type") != "revolute":
        kind = turning[0].element.get("type")
        raise urdf.error(f"joint {turning[0].name}", f"expected the type revolute, with limits, found {kind!r}")
    return turning[0]


def _axis(urdf: Urdf, joint: ElementTree.Element) -> Array:
    element = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if element is None else urdf.numbers(element, "xyz", 3)
    if not np.linalg.norm(axis) > 1e-6:
        raise urdf.error(f"joint {joint.get('name')} axis", "expected a direction, found zeros")
    unit: Array = axis / np.linalg.norm(axis)
    return unit


def _link_poses(
    urdf: Urdf, joints: list[_Joint], hinge: _Joint, axis: Array, angle: float
) -> dict[str, RigidTransform]:
    """The pose of every link in that of the root, the hinge at this angle."""
    names = [link.get("name", "") for link in urdf.root.findall("link")]
    roots = [name for name in names if name not in {joint.child for joint in joints}]
    if len(roots) != 1:
        raise urdf.error("links", f"expected one that no joint leads to, found {', '.join(roots) or 'none'}")
    poses = {roots[0]: RigidTransform.identity()}
    while waiting := [joint for joint in joints if joint.parent in poses and joint.child not in poses]:
        for joint in waiting:
            turn = revolute_pose(np.zeros(3), axis, angle if joint is hinge else 0.0)
            poses[joint.child] = poses[joint.parent] * _pose(urdf, joint.element) * turn
    if apart := [name for name in names if name not in poses]:
        raise urdf.error(f"link {apart[0]}", f"expected joints that lead to it from {roots[0]}, found none")
    return poses


def _links_below(joints: list[_Joint], name: str) -> set[str]:
    below = {name}
    while more := {joint.child for joint in joints if joint.parent in below} - below:
        below |= more
    return below


def _pose(urdf: Urdf, element: ElementTree.Element) -> RigidTransform:
    return RigidTransform.from_components(*urdf.origin(element))


def _read_part(urdf: Urdf, root: Path, poses: dict[str, RigidTransform]) -> ImportedPart:
    shown: list[tuple[Mesh, Colour | None]] = []
    solid: list[Mesh] = []
    bodies: list[Body | None] = []
    for name, pose in poses.items():
        link = urdf.link(name)
        visuals, collisions = link.findall("visual"), link.findall("collision")
        shown += [(_read_geometry(urdf, root, each, pose), _colour(urdf, each)) for each in visuals or collisions]
        solid += [_read_geometry(urdf, root, each, pose) for each in collisions or visuals]
        if link.find("inertial") is not None:
            bodies.append(moved_body(Body(*urdf.mass(link)), pose))
        elif visuals or collisions:
            bodies.append(None)
    if not shown:
        raise urdf.error(f"link {', '.join(poses)}", "expected a <visual> or a <collision>, found none")
    known = [body for body in bodies if body is not None]
    return ImportedPart(tuple(shown), tuple(solid), join_bodies(known) if known and len(known) == len(bodies) else None)


def _read_geometry(urdf: Urdf, root: Path, element: ElementTree.Element, link_pose: RigidTransform) -> Mesh:
    geometry = urdf.child(element, "geometry")
    shape = next(iter(geometry), None)
    kind = "nothing" if shape is None else shape.tag
    if shape is not None and kind == "mesh":
        scale = urdf.numbers(shape, "scale", 3) if shape.get("scale") else np.ones(3)
        if not scale.all():
            raise urdf.error("mesh scale", f"expected no zeros, found {shape.get('scale')!r}")
        file = _mesh_path(urdf, shape.get("filename", ""))
        check_inside(file, root, urdf.path)
        mesh = load_mesh(file, scale)
    elif shape is not None and kind == "box":
        mesh = mesh_of(trimesh.creation.box(_sizes(urdf, shape, "size", 3)))
    elif shape is not None and kind == "cylinder":
        (radius,), (length,) = (_sizes(urdf, shape, name, 1) for name in ("radius", "length"))
        mesh = mesh_of(trimesh.creation.cylinder(radius, length, sections=_ROUND_SECTIONS))
    elif shape is not None and kind == "sphere":
        mesh = mesh_of(trimesh.creation.icosphere(2, _sizes(urdf, shape, "radius", 1)[0]))
    else:
        raise urdf.error("geometry", f"expected a mesh, box, cylinder or sphere, found {kind}")
    return moved(mesh, link_pose * _pose(urdf, element))


def _sizes(urdf: Urdf, shape: ElementTree.Element, attribute: str, count: int) -> Array:
    sizes = urdf.numbers(shape, attribute, count)
    if not (sizes > 0).all():
        raise urdf.error(f"{shape.tag} {attribute}", f"expected positive sizes, found {shape.get(attribute)!r}")
    return sizes


def _mesh_path(urdf: Urdf, name: str) -> Path:
    """A mesh file beside the URDF file, or within its package: in a folder above, up to the one of that name."""
    if not name.startswith("package://"):
        return urdf.path.parent / name.removeprefix("file://")
    package, _, inside = name.removeprefix("package://").partition("/")
    folders = [urdf.path.parent, *urdf.path.absolute().parent.parents]
    candidates = [folder / each for folder in folders for each in (inside, Path(package, inside))]
    return next((path for path in candidates if path.is_file()), urdf.path.parent / inside)


def _colour(urdf: Urdf, visual: ElementTree.Element) -> Colour | None:
    """The linear RGB of a visual's material, which may be described elsewhere in the file."""
    material = visual.find("material")
    if material is None:
        return None
    named = [each for each in urdf.root.iter("material") if each.get("name") == material.get("name")]
    for each in (material, *named):
        if (colour := each.find("color")) is not None:
            red, green, blue = (urdf.numbers(colour, "rgba", 4)[:3].clip(0, 1) ** 2.2).tolist()
            return red, green, blue
    return None
