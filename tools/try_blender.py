"""Open exported motions in Blender, compare what it makes of them, and render a frame.

    python tools/try_blender.py SKINNED.usdc BAKED.usdc [PICTURE.png]

runs in a Python that has the package ``bpy`` (``pip install bpy``), or as ``blender -b -P tools/try_blender.py -- …``.
Both files are of one motion and rate, one with ``--hands skinned``, one with ``--hands baked``: Blender's armature must
put every vertex of a hand where the baked mesh has it.
"""

import math
import sys

import bpy
import numpy as np

FRAMES = (0, 0.25, 0.5, 1.0)
"""What is compared, as shares of the motion."""


def load(path: str) -> list[bpy.types.Object]:
    """The hands' surfaces of a file in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path, import_subdivision=False)
    found = [each for each in bpy.data.objects if each.type == "MESH" and len(each.data.vertices) > 1000]
    found = [each for each in found if "surface" in each.name]
    print(
        path, "fps", bpy.context.scene.render.fps, "frames", bpy.context.scene.frame_start, bpy.context.scene.frame_end
    )
    for kind in ("MESH", "ARMATURE"):
        print(" ", kind, sorted(each.name for each in bpy.data.objects if each.type == kind))
    return sorted(found, key=lambda each: each.name)


def points(surface: bpy.types.Object, frame: int) -> np.ndarray:
    """The vertices of a surface in the world [m]."""
    bpy.context.scene.frame_set(frame)
    shown = surface.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([tuple(shown.matrix_world @ vertex.co) for vertex in shown.to_mesh().vertices])


def main() -> None:
    """Compare, and render."""
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    skinned, baked, *picture = arguments
    where = []
    for path in (baked, skinned):
        surfaces = load(path)
        scene = bpy.context.scene
        frames = [round(scene.frame_start + share * (scene.frame_end - scene.frame_start)) for share in FRAMES]
        where.append([[points(surface, frame) for frame in frames] for surface in surfaces])
    for hand, (one, other) in enumerate(zip(*where, strict=True)):
        apart = [float(np.linalg.norm(a - b, axis=1).max()) for a, b in zip(one, other, strict=True)]
        print("hand", hand, "largest distance at frames", frames, "[m]:", [f"{value:.2g}" for value in apart])
    if picture:
        render(surfaces[0], picture[0])


def render(surface: bpy.types.Object, path: str) -> None:
    """Render the last frame with Cycles on the CPU."""
    scene = bpy.context.scene
    middle = points(surface, scene.frame_end).mean(axis=0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = middle + np.array([0.55, -0.55, 0.4])
    camera.rotation_euler = (math.radians(63), 0, math.radians(45))
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (0.6, 0.3, 0)
    scene.collection.objects.link(camera)
    scene.collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("sky")
    scene.world.color = (0.6, 0.65, 0.7)
    scene.camera, scene.render.engine, scene.cycles.samples, scene.cycles.device = camera, "CYCLES", 24, "CPU"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.threads_mode, scene.render.threads = (
        480,
        360,
        "FIXED",
        1,
    )
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
