"""Picture the frames: of the world, of both parts of an object and of a hand's wrist, and the hinge's axis.

    python -m tools.picture_frames docs/images/frames.webp [--object open-box] [--reference 0] [--angle 0.9] [--size N]

Axes are red, green and blue for x, y and z; the hinge's is yellow, and turns like a right-handed screw along its arrow.
"""

import argparse
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.cli.warp_start import start_warp
from artigrasp.export.camera import look_at
from artigrasp.export.hand_surface import hand_surface
from artigrasp.export.image_file import save_image
from artigrasp.export.raycaster import render_surface
from artigrasp.export.surface import Surface, join, mesh_surface, part_surface, place
from artigrasp.motion.kinematics import pose_object, posed_references
from artigrasp.references.reference import load_references

AXES = ((0.65, 0.03, 0.03), (0.03, 0.40, 0.05), (0.03, 0.10, 0.65))
"""Linear RGB of x, y and z."""
HINGE = (0.85, 0.55, 0.02)
LENGTH, THICKNESS = 0.07, 0.0025
"""Of an axis of a frame [m]."""
DIRECTION = (np.radians(-48.0), np.radians(26.0))
"""Where the camera is: azimuth from x, elevation [rad]."""
ASPECT = 4 / 3

Coloured = tuple[Surface, Array]
"""A surface, and linear RGB of each of its faces."""


def arrow(start: Array, along: Array, length: float, colour: tuple[float, float, float]) -> Coloured:
    """An arrow from a point in a direction."""
    head = 8.0 * THICKNESS
    shaft = trimesh.creation.cylinder(THICKNESS, length - head).apply_translation((0.0, 0.0, (length - head) / 2))
    tip = trimesh.creation.cone(3.0 * THICKNESS, head).apply_translation((0.0, 0.0, length - head))
    turn, _ = Rotation.align_vectors([along], [[0.0, 0.0, 1.0]])
    surface = join([mesh_surface(each.vertices, each.faces) for each in (shaft, tip)])
    return place(surface, np.concatenate([start, turn.as_quat()])), np.tile(colour, (len(surface.faces), 1))


def frame(pose: NDArray[np.floating], length: float = LENGTH) -> list[Coloured]:
    """The axes of the frame of a pose."""
    axes = Rotation.from_quat(pose[3:]).as_matrix().T
    return [arrow(pose[:3].astype(float), axis, length, colour) for axis, colour in zip(axes, AXES, strict=True)]


def main() -> None:
    """Render and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--object", default="open-box")
    parser.add_argument("--reference", type=int, default=0)
    parser.add_argument("--angle", type=float, default=0.9)
    parser.add_argument("--size", type=int, default=760, help="width of the picture [px]")
    options = parser.parse_args()
    start_warp()
    chosen = load_references(options.object)
    chosen = chosen.select(split="test", kind="articulate", hands=["right"], indices=options.reference)
    hand, object = load_hand(chosen.hand, "right"), load_object(options.object)
    links, closed = posed_references(chosen, [load_hand(chosen.hand, side) for side in ("left", "right")], object)
    base = closed[0, 0]
    parts = pose_object(base[None], np.array([options.angle]), object)[0]
    # the hand belongs to the part: it goes along as that turns
    moved = Rotation.from_quat(parts[1, 3:]) * Rotation.from_quat(closed[0, 1, 3:]).inv()
    positions = moved.apply(links[0, 1, :, :3] - closed[0, 1, :3]) + parts[1, :3]
    turned = (moved * Rotation.from_quat(links[0, 1, :, 3:])).as_quat()
    posed = np.concatenate([positions, turned], axis=1).astype(np.float32)

    skin = hand_surface(hand, rigid=False)
    shown: list[Coloured] = [(skin.posed(posed), skin.colours)]
    for part, pose in zip(object.parts, parts, strict=True):
        surface, colours = part_surface(part)
        shown.append((place(surface, pose), colours))
    to_world = Rotation.from_quat(base[3:])
    axis, hinge = to_world.apply(object.hinge_axis), to_world.apply(object.hinge_origin) + base[:3]
    shown.append(arrow(hinge - 0.22 * axis, axis, 0.44, HINGE))
    corner = np.array([0.32, -0.02, 0.002, 0.0, 0.0, 0.0, 1.0])
    for pose, length in ((base, 0.2), (parts[1], 0.2), (posed[0], 0.12), (corner, LENGTH)):
        shown += frame(pose, length)
    surface = join([each for each, _ in shown])
    view = look_at(surface.vertices, DIRECTION, ASPECT)
    colours = np.concatenate([each for _, each in shown])
    image = render_surface(surface, colours, view, width=options.size, height=round(options.size / ASPECT))
    save_image(image, options.out)


if __name__ == "__main__":
    main()
