"""The MANO mean-shape hand from the URDF of the ArtiGrasp release.

There every ball joint is three stacked hinges with the mass on the first link of the three and the shapes on the last;
all share one origin, so that a triple becomes one link here.
"""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import Box, Capsule, Collider, HandModel
from artigrasp.assets.urdf import Urdf, read_urdf
from artigrasp.kernels.layout import DOF_COUNT, LINKS, TIP_FINGERS, WRIST_DOF_COUNT

WRIST_LIMITS = np.repeat([2.8, np.pi], 3)
"""The wrist moves about a base frame that is set per world [m, rad]: wide enough for every task."""
ARMATURE = np.where(np.arange(DOF_COUNT) < 3, 0.0, 1e-3)
"""[kg, kg·m²]: the phalanges' own inertia is too small for stable contact."""
EFFORT = np.where(np.arange(DOF_COUNT) < 3, 100.0, 3.0)
"""[N, N·m]: the release allows 1000 N·m, with which objects squirt out of the hand and solvers diverge."""

LONGEST_BONE = 0.2
"""No link is further from its parent [m]; a larger number is in another unit."""


def read_urdf_hand(urdf_path: Path, name: str, side: str, path: Path) -> HandModel:
    """Convert a hand of the release.

    Joint limits of the fingers, damping, masses and shapes are the file's; wrist limits, armature and effort are ours.

    Args:
        urdf_path: ``rhand_mano.urdf`` or ``lhand_mano.urdf``.
        name: Name of the new hand.
        side: The side that the file describes, ``"left"`` or ``"right"``.
        path: The USD file that the new hand will live in.

    Raises:
        UserError: the file is missing or not such a hand.
    """
    urdf = read_urdf(urdf_path)
    joints = [urdf.joint(f"{side}_wrist_0{axis}") for axis in ("x", "y", "z", "rx", "ry", "rz")]
    joints += [urdf.joint(f"{side}_{link}_{axis}") for link in LINKS[1:] for axis in "xyz"]
    lower, upper = (np.array([urdf.number(urdf.child(j, "limit"), end) for j in joints]) for end in ("lower", "upper"))
    lower[:WRIST_DOF_COUNT], upper[:WRIST_DOF_COUNT] = -WRIST_LIMITS, WRIST_LIMITS
    offset = np.stack([np.zeros(3), *(urdf.origin(joint)[0] for joint in joints[WRIST_DOF_COUNT::3])])
    if (far := np.flatnonzero(np.linalg.norm(offset, axis=1) > LONGEST_BONE)).size:
        found = f"found {np.linalg.norm(offset[far[0]]):g}"
        raise urdf.error(f"link {LINKS[far[0]]}", f"expected at most {LONGEST_BONE} m from its parent, {found}")
    bodies = [urdf.mass(urdf.link(f"{side}_{link}")) for link in LINKS]
    shapes = [urdf.link(f"{side}_{'wrist_rz' if link == 'wrist' else f'{link}_z'}") for link in LINKS]
    return HandModel(
        name=name,
        side=side,
        path=path,
        link_offset=offset,
        tip_offset=np.stack([_tip_offset(urdf, side, finger) for finger in TIP_FINGERS]),
        lower=lower,
        upper=upper,
        damping=np.array([urdf.number(urdf.child(joint, "dynamics"), "damping") for joint in joints]),
        armature=ARMATURE.copy(),
        effort=EFFORT.copy(),
        link_mass=np.array([mass for mass, _, _ in bodies]),
        link_com=np.stack([com for _, com, _ in bodies]),
        link_inertia=np.stack([inertia for _, _, inertia in bodies]),
        colliders=tuple(_colliders(urdf, link) for link in shapes),
    )


def _tip_offset(urdf: Urdf, side: str, finger: str) -> Array:
    offset: Array = urdf.origin(urdf.joint(f"{side}_{finger}_tip"))[0]
    return offset


def _colliders(urdf: Urdf, link: ElementTree.Element) -> tuple[Collider, ...]:
    colliders: list[Collider] = []
    for element in link.iter("collision"):
        position, rotation = urdf.origin(element)
        orientation = rotation.as_quat(canonical=True)
        shape = next(iter(urdf.child(element, "geometry")))
        if shape.tag == "capsule":
            colliders.append(Capsule(position, orientation, urdf.number(shape, "radius"), urdf.number(shape, "length")))
        elif shape.tag == "box":
            colliders.append(Box(position, orientation, urdf.numbers(shape, "size", 3)))
        else:
            raise urdf.error(f"link {link.get('name')}", f"expected capsules and boxes, found a {shape.tag}")
    return tuple(colliders)
