"""Episodes that begin in the middle: hands and objects go on from an instant instead of where a reference starts."""

import warp as wp

from .phase_starts import move_hand_base
from .states import Goal, HandState, ObjectState, PhaseState

wp.set_module_options({"enable_backward": False})


@wp.struct
class HandInstant:
    """The hands of one world at one instant, ``H`` of them.

    Attributes:
        joint_q: [H, 51] joint coordinates, m and rad.
        joint_qd: [H, 51] their rates, m/s and rad/s.
        hand_base: [H] frame that the wrist coordinates are relative to, in the world.
        target: [H, 51] PD targets, m and rad.
        stiffness, damping: [H, 3] PD gains of the `DOF_GROUPS`, N/m and N.m/rad, N.s/m and N.m.s/rad.
    """

    joint_q: wp.array2d[float]
    joint_qd: wp.array2d[float]
    hand_base: wp.array[wp.transform]
    target: wp.array2d[float]
    stiffness: wp.array2d[float]
    damping: wp.array2d[float]


@wp.kernel
def resume_worlds(
    world_mask: wp.array[int],
    instant: HandInstant,
    object_state: ObjectState,
    goal_angle: wp.array[float],
    target_object_pose: wp.array[wp.transform],
    # outputs
    hand_state: HandState,
    goal: Goal,
    phase: PhaseState,
    target: wp.array3d[float],
    stiffness: wp.array3d[float],
    damping: wp.array3d[float],
):
    """Let the episodes of the masked worlds, just reset, begin at an instant; launch with ``dim=(W, H)``.

    The base frame of every hand moves to where its wrist is, unless the hand keeps its targets.

    Args:
        world_mask: [W] int, 1 where to.
        instant: of the hands, the same for all worlds.
        object_state: the objects at that instant.
        goal_angle: [W] target angle, rad; negative to keep it as it is.
        target_object_pose: [W] target of the base in the world.
        hand_state, target, stiffness, damping: outputs, see `HandInstant`; all but the first [W, H, ...].
        goal, phase: outputs: start and target of the object.
    """
    world, hand = wp.tid()
    if world_mask[world] == 0:
        return
    hand_state.hand_base[world, hand] = instant.hand_base[hand]
    for dof in range(hand_state.joint_q.shape[2]):
        hand_state.joint_q[world, hand, dof] = instant.joint_q[hand, dof]
        hand_state.joint_qd[world, hand, dof] = instant.joint_qd[hand, dof]
        target[world, hand, dof] = instant.target[hand, dof]
    for group in range(stiffness.shape[2]):
        stiffness[world, hand, group] = instant.stiffness[hand, group]
        damping[world, hand, group] = instant.damping[hand, group]
    if goal.keeps[world, hand] == 0:
        move_hand_base(hand_state, world, hand)
    if hand == 0:
        angle = object_state.hinge_q[world]
        goal.start_object_pose[world] = object_state.pose[world]
        phase.start_object_pose[world] = object_state.pose[world]
        goal.start_angle[world] = angle
        goal.target_angle[world] = wp.where(goal_angle[world] >= 0.0, goal_angle[world], angle)
        goal.target_object_pose[world] = target_object_pose[world]
