"""Joint torques of the PD controller."""

import warp as wp

DOF_GROUPS = ("wrist_translation", "wrist_rotation", "fingers")
"""Groups of joint coordinates that share a gain or a scale: DoFs 0-2, 3-5 and 6-50."""


@wp.func
def dof_group(dof: int) -> int:
    """Index into `DOF_GROUPS` of a joint coordinate."""
    return wp.min(dof // 3, 2)


@wp.kernel
def pd_torques(
    target: wp.array3d[float],
    joint_q: wp.array3d[float],
    joint_qd: wp.array3d[float],
    stiffness: wp.array3d[float],
    damping: wp.array3d[float],
    effort: wp.array2d[float],
    torque: wp.array3d[float],
):
    """``clamp(kp (q* - q) - kd q', -effort, effort)`` per joint coordinate; launch with ``dim=(W, H)``.

    Args:
        target: [W, H, 51] PD targets, m and rad.
        joint_q, joint_qd: [W, H, 51] joint coordinates and rates.
        stiffness, damping: [W, H, 3] gains of the `DOF_GROUPS`, N/m and N.m/rad, N.s/m and N.m.s/rad.
        effort: [H, 51] largest magnitudes, N and N.m.
        torque: [W, H, 51] output, N and N.m.
    """
    world, hand = wp.tid()
    for dof in range(target.shape[2]):
        group = dof_group(dof)
        unlimited = (
            stiffness[world, hand, group] * (target[world, hand, dof] - joint_q[world, hand, dof])
            - damping[world, hand, group] * joint_qd[world, hand, dof]
        )
        limit = effort[hand, dof]
        torque[world, hand, dof] = wp.clamp(unlimited, -limit, limit)
