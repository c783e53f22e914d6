"""Author the open hand: our own, with the proportions of a human hand and the topology of every hand here.

    python tools/author_open_hand.py [FOLDER]

writes ``open_right.usda`` and ``open_left.usda``, its exact mirror image, to ``assets_usd/hands``.

Bone lengths are the means of Buryanov and Kotiuk, Proportions of hand segments, Int. J. Morphol. 28(3), 2010, rounded
to 0.5 mm; with 25 mm from the wrist joint to the metacarpals the middle fingertip is 0.182 m from the wrist joint.
Breadths and the hand's mass are round adult values. Joint ranges follow clinical ranges of motion: 30° of extension and
90° of flexion at the knuckles, 100° and 80° at the next two joints, 20° of abduction, a few degrees of compliance about
the axes on which finger joints do not move.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import Box, Capsule, Collider, HandModel, mirror, write_hand
from artigrasp.assets.skin_drawing import draw_skin
from artigrasp.kernels.layout import DOF_COUNT, FINGERS, LINK_COUNT, TIP_FINGERS

BONES = {
    "index": (0.0680, 0.0400, 0.0225, 0.0160),
    "middle": (0.0645, 0.0445, 0.0265, 0.0175),
    "pinky": (0.0535, 0.0325, 0.0180, 0.0160),
    "ring": (0.0580, 0.0415, 0.0255, 0.0175),
    "thumb": (0.0460, 0.0315, 0.0215),
}
"""Lengths of the metacarpal (the thumb's moves, the others are the palm) and the phalanges [m]."""
PULP = {"index": 0.0038, "middle": 0.0040, "pinky": 0.0037, "ring": 0.0040, "thumb": 0.0057}
"""Soft tissue beyond the last bone [m]."""
RADII = {
    "index": (0.0095, 0.0085, 0.0075),
    "middle": (0.0095, 0.0085, 0.0075),
    "pinky": (0.0080, 0.0070, 0.0065),
    "ring": (0.0090, 0.0080, 0.0070),
    "thumb": (0.0125, 0.0110, 0.0095),
}
"""Radius of each link [m]."""
CARPUS = 0.025
"""From the wrist joint to the metacarpals [m]."""
KNUCKLE_Z = {"index": 0.026, "middle": 0.003, "pinky": -0.038, "ring": -0.018}
KNUCKLE_Y = {"index": -0.002, "middle": 0.0, "pinky": -0.005, "ring": -0.0015}
"""Knuckles across the palm (thumb side positive) and off its plane, the transverse arch (palm side negative) [m]."""
SPREAD = {"index": 4.0, "middle": 0.0, "pinky": -10.0, "ring": -4.0}
"""Direction of the straight fingers in the palm's plane [deg], towards the thumb positive."""
THUMB_BASE = (-0.022, -0.012, 0.022)
THUMB_DIRECTIONS = ((-0.72, -0.20, 0.66), (-0.84, -0.16, 0.52), (-0.88, -0.14, 0.45))
"""The thumb's first joint in the wrist frame [m], and the directions of its three bones at rest."""
PALM = Box(np.array([-0.047, 0.0, -0.005]), np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.090, 0.026, 0.078]))
THENAR_RADIUS = 0.0145

LIMITS_DEG = {
    "knuckle": ((-10, 10), (-20, 20), (-30, 90)),
    "finger": ((-6, 6), (-6, 6), (-5, 100)),
    "fingertip": ((-6, 6), (-6, 6), (-10, 80)),
    "thumb1": ((-30, 60), (-45, 35), (-30, 50)),
    "thumb2": ((-25, 25), (-60, 20), (-30, 60)),
    "thumb3": ((-25, 25), (-80, 20), (-30, 60)),
}
"""Ranges about x, y, z: twist, abduction and flexion of a finger; the thumb flexes about all three."""
MASS, TISSUE_DENSITY = 0.40, 1100.0
"""Mass of the hand [kg] and density of the fingers [kg/m³]; the palm weighs the rest."""


def open_hand(folder: Path) -> HandModel:
    """The right open hand, to live in this folder."""
    offset, tip = np.zeros((LINK_COUNT, 3)), {}
    colliders: list[tuple[Collider, ...]] = [(PALM, _thenar())]
    lower, upper = np.zeros((LINK_COUNT, 3)), np.zeros((LINK_COUNT, 3))
    for finger_index, finger in enumerate(FINGERS):
        base, bones = _bones(finger)
        for joint, radius in enumerate(RADII[finger]):
            link = 1 + 3 * finger_index + joint
            last = joint == 2
            offset[link] = base if joint == 0 else bones[joint - 1]
            colliders.append((_phalanx(bones[joint], radius, PULP[finger] if last else None),))
            kind = f"thumb{joint + 1}" if finger == "thumb" else ("knuckle", "finger", "fingertip")[joint]
            lower[link], upper[link] = np.radians(LIMITS_DEG[kind]).T
        tip[finger] = bones[2] * (1 + PULP[finger] / np.linalg.norm(bones[2]))

    tissue = [_tissue(shapes[0]) for shapes in colliders]
    mass, com, inertia = (np.stack(values) for values in zip(*tissue, strict=True))
    inertia[0] *= (MASS - mass[1:].sum()) / mass[0]
    mass[0] = MASS - mass[1:].sum()
    slides = np.arange(DOF_COUNT) < 3
    wrist_limit = np.repeat([2.8, np.pi], 3)
    hand = HandModel(
        name="open",
        side="right",
        path=folder / "open_right.usda",
        link_offset=offset,
        tip_offset=np.stack([tip[finger] for finger in TIP_FINGERS]),
        lower=np.concatenate([-wrist_limit, lower[1:].ravel()]),
        upper=np.concatenate([wrist_limit, upper[1:].ravel()]),
        damping=np.where(slides, 10.0, 1.0),
        armature=np.where(slides, 0.0, 1e-3),
        effort=np.where(slides, 100.0, 3.0),
        link_mass=mass,
        link_com=com,
        link_inertia=inertia,
        colliders=tuple(colliders),
    )
    return replace(hand, skin=draw_skin(hand))


def _bones(finger: str) -> tuple[Array, list[Array]]:
    """The first joint of a finger in the wrist frame, and the vectors along its three bones [m]."""
    if finger == "thumb":
        unit = [np.array(direction) / np.linalg.norm(direction) for direction in THUMB_DIRECTIONS]
        return np.array(THUMB_BASE), [length * u for length, u in zip(BONES[finger], unit, strict=True)]
    metacarpal, *lengths = BONES[finger]
    y, z, spread = KNUCKLE_Y[finger], KNUCKLE_Z[finger], np.radians(SPREAD[finger])
    direction = np.array([-np.cos(spread), 0.0, np.sin(spread)])
    # The metacarpals fan out from the carpus, which is half as broad as the row of knuckles.
    knuckle = np.array([-CARPUS - np.sqrt(metacarpal**2 - (z / 2) ** 2 - y**2), y, z])
    return knuckle, [length * direction for length in lengths]


def _phalanx(bone: Array, radius: float, pulp: float | None) -> Capsule:
    """A capsule from joint to joint, or from the last joint to the fingertip."""
    length = float(np.linalg.norm(bone))
    start, end = 0.0, length if pulp is None else length + pulp - radius
    axis = bone / length
    return Capsule((start + end) / 2 * axis, _turn_z_to(axis), radius, end - start)


def _thenar() -> Capsule:
    """The muscle at the base of the thumb."""
    start, end = np.array([-0.014, -0.006, 0.012]), np.array(THUMB_BASE) + np.array([-0.012, 0.0, 0.006])
    axis = end - start
    return Capsule((start + end) / 2, _turn_z_to(axis), THENAR_RADIUS, float(np.linalg.norm(axis)))


def _turn_z_to(axis: ArrayLike) -> Array:
    turn: Array = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_quat(canonical=True)
    return turn


def _tissue(shape: Collider) -> tuple[float, Array, Array]:
    """Mass, centre and inertia of a shape filled with tissue."""
    if isinstance(shape, Box):
        mass = TISSUE_DENSITY * shape.extents.prod()
        squares = shape.extents**2
        local = mass / 12 * np.diag(squares.sum() - squares)
    else:
        r, length = shape.radius, shape.length
        cylinder, sphere = np.pi * r**2 * length, 4 / 3 * np.pi * r**3
        mass = TISSUE_DENSITY * (cylinder + sphere)
        along = cylinder * r**2 / 2 + sphere * 0.4 * r**2
        across = cylinder * (length**2 / 12 + r**2 / 4)
        across += sphere * (0.4 * r**2 + length**2 / 4 + 3 / 8 * length * r)
        local = TISSUE_DENSITY * np.diag([across, across, along])
    axes = Rotation.from_quat(shape.orientation).as_matrix()
    return float(mass), shape.position, axes @ local @ axes.T


def main() -> None:
    """Write both hands."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "assets_usd" / "hands")
    right = open_hand(folder)
    for hand in (right, mirror(right, folder / "open_left.usda")):
        write_hand(hand)
        print(hand.path)


if __name__ == "__main__":
    main()
