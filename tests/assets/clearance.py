"""How deep the pieces of an object's two parts are in each other, by MuJoCo's distances of convex meshes."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.assets.object import ObjectModel


def deepest_overlap(model: ObjectModel, angles: np.ndarray) -> float:
    """The most that a piece of the one part is within a piece of the other at any of these hinge angles [m]."""
    spec = mujoco.MjSpec()
    bodies = []
    for index, part in enumerate(model.parts):
        body = spec.worldbody.add_body(name=f"part{index}", mocap=True)
        for number, piece in enumerate(part.pieces):
            name = f"part{index}_{number}"
            spec.add_mesh(name=name, uservert=piece.vertices.ravel(), userface=piece.faces.ravel())
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
        bodies.append([f"part{index}_{number}" for number in range(len(part.pieces))])
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    base, articulated = ([compiled.geom(name).id for name in names] for names in bodies)
    mocap = compiled.body_mocapid[compiled.body("part1").id]
    deepest = 0.0
    for angle in angles:
        position, orientation = model.articulated_pose_in_base(float(angle))
        data.mocap_pos[mocap] = position
        data.mocap_quat[mocap] = Rotation.from_quat(orientation).as_quat(scalar_first=True)
        mujoco.mj_kinematics(compiled, data)
        for one in base:
            for other in articulated:
                between = np.linalg.norm(data.geom_xpos[one] - data.geom_xpos[other])
                if between < compiled.geom_rbound[one] + compiled.geom_rbound[other]:
                    deepest = max(deepest, -mujoco.mj_geomDistance(compiled, data, one, other, 0.01, None))
    return deepest
