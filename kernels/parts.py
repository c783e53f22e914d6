"""Poses of both parts of a hinged object over a batch."""

import warp as wp

from .kinematics import part_pose
from .states import ObjectModel, ObjectState

wp.set_module_options({"enable_backward": False})


@wp.kernel
def pose_parts(object_state: ObjectState, object_model: ObjectModel, part_poses: wp.array2d[wp.transform]):
    """Frames of both parts [W, 2], in the frame that the base's pose is given in; m. Launch with ``dim=(W, 2)``."""
    world, part = wp.tid()
    part_poses[world, part] = part_pose(
        object_state.pose[world],
        object_model.hinge_origin[world],
        object_model.hinge_axis[world],
        object_state.hinge_q[world],
        part,
    )
