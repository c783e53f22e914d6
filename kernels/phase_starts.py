"""How a phase of a long motion begins: what it asks of hands and object, and from where (see `phases`)."""

import warp as wp

from .kinematics import wrist_pose, wrist_twist
from .phases import PhaseLimits, PhaseTable
from .resets import ReferenceTable, set_hand_goal, start_counting
from .states import Goal, HandModel, HandState, ObjectState, PhaseState

wp.set_module_options({"enable_backward": False})


@wp.kernel
def set_phase_goal(
    world_mask: wp.array[int],
    references: ReferenceTable,
    reference_index: wp.array[int],
    table: PhaseTable,
    object_state: ObjectState,
    phase: PhaseState,
    # outputs
    goal: Goal,
    stiffness: wp.array3d[float],
    damping: wp.array3d[float],
):
    """What the phase that begins asks of the object, who helps, and its gains; launch with ``dim=W``.

    Args:
        world_mask: [W] int, 1 where a phase begins.
        references: the references.
        reference_index: [W] int, the one that is played.
        table, object_state, phase: inputs.
        goal: output: ``angle``, ``object_pose`` and ``engaged``.
        stiffness, damping: [W, H, 3] outputs.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    index = phase.index[world]
    goal.angle[world] = wp.where(table.opens[index] != 0, goal.target_angle[world], goal.start_angle[world])
    asked = object_state.pose[world]
    if table.carries[index] != 0:
        if table.raises[index] == 0:
            asked = goal.target_object_pose[world]
        asked = wp.transform(wp.vec3(0.0, 0.0, table.lift[index]), wp.quat_identity()) * asked
    goal.object_pose[world] = asked
    for hand in range(stiffness.shape[1]):
        steadies = table.steadies[index] * references.steadies[reference_index[world], hand]
        goal.engaged[world, hand] = wp.max(goal.active[world, hand], steadies)
        if goal.keeps[world, hand] == 0:
            for group in range(stiffness.shape[2]):
                stiffness[world, hand, group] = table.stiffness[index, group]
                damping[world, hand, group] = table.damping[index, group]


@wp.func
def move_hand_base(hand_state: HandState, world: int, hand: int):
    """Move a hand's base frame to where its wrist is, which in the world stays and moves as it does."""
    twist = wrist_twist(hand_state, world, hand)
    base = wrist_pose(hand_state, world, hand)
    hand_state.hand_base[world, hand] = base
    to_base = wp.quat_inverse(wp.transform_get_rotation(base))
    linear = wp.quat_rotate(to_base, wp.spatial_top(twist))
    # At zero angles the axes of the three wrist hinges are those of the base.
    angular = wp.quat_rotate(to_base, wp.spatial_bottom(twist))
    for axis in range(3):
        hand_state.joint_q[world, hand, axis] = 0.0
        hand_state.joint_q[world, hand, 3 + axis] = 0.0
        hand_state.joint_qd[world, hand, axis] = linear[axis]
        hand_state.joint_qd[world, hand, 3 + axis] = angular[axis]


@wp.kernel
def begin_phases(
    begins: wp.array[int],
    references: ReferenceTable,
    phase_references: wp.array2d[int],
    table: PhaseTable,
    limits: PhaseLimits,
    hand_model: HandModel,
    object_state: ObjectState,
    # outputs
    reference_index: wp.array[int],
    hand_state: HandState,
    goal: Goal,
    phase: PhaseState,
):
    """Begin a phase in every masked world; launch with ``dim=W``.

    The base frame of every hand moves to where its wrist is, so that the wrist coordinates become zero, unless the hand
    keeps its targets. In the world nothing moves, and velocities stay as they are.

    Args:
        begins: [W] int, 1 where a phase begins.
        references: the references.
        phase_references: [W, 2] int, the references that a world's phases choose from.
        table, limits, hand_model, object_state: inputs.
        reference_index: [W] int in and out, the reference that is played.
        hand_state: in and out.
        goal, phase: outputs; what is asked of the object is left to `set_phase_goal`.
    """
    world = wp.tid()
    if begins[world] == 0:
        return
    index = phase.index[world]
    reference = phase_references[world, table.reference[index]]
    is_another = reference != reference_index[world]
    reference_index[world] = reference
    for hand in range(references.active.shape[1]):
        if is_another:  # else it stays as the reset wrote it, with its noise
            set_hand_goal(
                references,
                reference,
                references.wrist_pose_in_part[reference, hand],
                limits.limit_margin,
                hand_model,
                goal,
                world,
                hand,
            )
        if goal.keeps[world, hand] == 0:
            move_hand_base(hand_state, world, hand)
    start_counting(phase, world, object_state.pose[world])
    if table.decides[index] != 0:
        phase.decision_step[world] = 0
