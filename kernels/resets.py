"""Resets: put an object and its hands where a reference starts, and write what the hands are asked to do."""

import warp as wp

from .episodes import EPISODE_STRIDE
from .kinematics import part_pose, pose_fingers
from .layout import WRIST_DOF_COUNT
from .poses import offset_pose
from .states import Goal, HandModel, HandState, ObjectModel, ObjectState, PhaseState
from .wrist_priors import move_away

wp.set_module_options({"enable_backward": False})

_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)


@wp.struct
class ReferenceTable:
    """The references that worlds may be reset to; ``R`` of them, of all objects.

    Attributes:
        articulate: [R] int, 1 for articulation, 0 for grasping.
        active: [R, H] int, 1 where the hand takes part.
        steadies: [R, H] int, 1 where a hand that takes no part holds the base in its reference pose.
        part: [R, H] int, the part that the hand manipulates.
        wrist_pose_in_part: [R, H] wrist frame in that part's frame.
        finger_angles: [R, H, 45] rad.
        contacts: [R, H, 16] target contacts, 0 or 1.
        object_pose: [R] base frame in the world at the start.
        object_angle: [R] hinge angle at the start, rad.
    """

    articulate: wp.array[int]
    active: wp.array2d[int]
    steadies: wp.array2d[int]
    part: wp.array2d[int]
    wrist_pose_in_part: wp.array2d[wp.transform]
    finger_angles: wp.array3d[float]
    contacts: wp.array3d[float]
    object_pose: wp.array[wp.transform]
    object_angle: wp.array[float]


@wp.struct
class ResetSettings:
    """Where episodes start.

    Attributes:
        pregrasp_distance: from the reference, away from the base frame's origin, m.
        idle_distance: the same for hands that take no part, m.
        wrist_clearance, idle_clearance: least height of the wrist over the support plane, m, for hands that take part
            and those that do not.
        open_fraction: fraction of the reference's finger angles at the start.
        position_noise: largest offset of each wrist translation, m.
        angle_noise: largest offset of each wrist rotation and finger angle, rad.
        reference_position_noise: largest offset of each coordinate of the reference's wrist position in the part, m.
        reference_rotation_noise: largest turn of the reference's wrist about each axis of the part, rad.
        goal_lower, goal_upper: range of the target angle of articulation, rad.
        limit_margin: room that the effective joint limits leave around the reference, rad.
    """

    pregrasp_distance: float
    idle_distance: float
    wrist_clearance: float
    idle_clearance: float
    open_fraction: float
    position_noise: float
    angle_noise: float
    reference_position_noise: float
    reference_rotation_noise: float
    goal_lower: float
    goal_upper: float
    limit_margin: float


@wp.func
def wrist_noise(base: wp.transform, noise: wp.vec3, clearance: float) -> wp.vec3:
    """Wrist translation in the base frame, shortened where it would take the wrist below its clearance."""
    offset = wp.transform_vector(base, noise)
    lowest = wp.min(clearance - wp.transform_get_translation(base)[2], 0.0)
    return wp.quat_rotate_inv(wp.transform_get_rotation(base), wp.vec3(offset[0], offset[1], wp.max(offset[2], lowest)))


@wp.func
def set_hand_goal(
    references: ReferenceTable,
    reference: int,
    wrist_in_part: wp.transform,
    limit_margin: float,
    hand_model: HandModel,
    goal: Goal,
    world: int,
    hand: int,
):
    """Write what one hand is asked to do by a reference, whose wrist pose may have been changed."""
    part = references.part[reference, hand]
    goal.active[world, hand] = references.active[reference, hand]
    goal.part[world, hand] = part
    # Articulation asks for contact with the part that moves, grasping with any.
    goal.contact_part[world, hand] = wp.where(references.articulate[reference] != 0, part, -1)
    goal.wrist_pose_in_part[world, hand] = wrist_in_part
    for link in range(goal.contacts.shape[2]):
        goal.contacts[world, hand, link] = references.contacts[reference, hand, link]
    for dof in range(goal.lower.shape[2]):
        lower = hand_model.lower[hand, dof]
        upper = hand_model.upper[hand, dof]
        if dof >= _WRIST_DOF_COUNT:
            angle = references.finger_angles[reference, hand, dof - _WRIST_DOF_COUNT]
            goal.finger_angles[world, hand, dof - _WRIST_DOF_COUNT] = angle
            lower = wp.min(lower, angle - limit_margin)
            upper = wp.max(upper, angle + limit_margin)
        goal.lower[world, hand, dof] = lower
        goal.upper[world, hand, dof] = upper
    pose_fingers(
        wrist_in_part,
        goal.finger_angles,
        0,
        world,
        hand,
        hand_model,
        goal.link_pose_in_part,
        goal.keypoint_in_part,
    )


@wp.func
def set_object_goal(
    goal: Goal, world: int, start_pose: wp.transform, start_angle: float, target_offset: wp.transform, angle: float
):
    """Write where the object of a world starts, and where it should go and open to."""
    goal.start_object_pose[world] = start_pose
    goal.start_angle[world] = start_angle
    goal.target_angle[world] = angle
    goal.target_object_pose[world] = wp.transform(
        wp.transform_get_translation(start_pose) + wp.transform_get_translation(target_offset),
        wp.transform_get_rotation(target_offset) * wp.transform_get_rotation(start_pose),
    )


@wp.func
def start_counting(phase: PhaseState, world: int, object_pose: wp.transform):
    """Let a phase begin now, with the object here."""
    phase.step[world] = 0
    phase.settled_steps[world] = 0
    phase.untouched_steps[world] = 0
    phase.start_object_pose[world] = object_pose


@wp.kernel
def reset_worlds(
    world_mask: wp.array[int],
    reference_index: wp.array[int],
    goal_angle_fixed: wp.array[float],
    target_offset: wp.array[wp.transform],
    episode: wp.array[int],
    seed: int,
    references: ReferenceTable,
    settings: ResetSettings,
    hand_model: HandModel,
    object_model: ObjectModel,
    hand_state: HandState,
    object_state: ObjectState,
    goal: Goal,
    phase: PhaseState,
):
    """Start an episode in every masked world; launch with ``dim=W``.

    The pre-grasp pose of the paper (Section 5): the reference wrist pose is attached to the object
    as it is at the start, displaced along the direction from the object to the wrist; the fingers are partly open.

    Args:
        world_mask: [W] int, 1 where to reset.
        reference_index: [W] int, the reference of each world.
        goal_angle_fixed: [W] target angle, rad; negative to draw it (articulation) or keep the start (grasping).
        target_offset: [W] from the start to the target of the base: shift, and turn about its origin, along the
            world's axes.
        episode: [W] int, resets so far; the noise is a function of seed, world and this count, which goes up by one.
        seed: of the noise.
        references, settings, hand_model, object_model: inputs.
        hand_state, object_state, goal, phase: outputs. Velocities and contact forces become zero; ``link_pose`` and
            ``keypoint`` are left to `forward_kinematics`. The first phase begins; what it asks of the object is left
            to `set_phase_goal`.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    random = wp.rand_init(seed + EPISODE_STRIDE * episode[world], world)
    episode[world] = episode[world] + 1
    reference = reference_index[world]
    hinge_origin = object_model.hinge_origin[world]
    hinge_axis = object_model.hinge_axis[world]

    object_pose = references.object_pose[reference]
    start_angle = references.object_angle[reference]
    object_state.pose[world] = object_pose
    object_state.velocity[world] = wp.spatial_vector()
    object_state.hinge_q[world] = start_angle
    object_state.hinge_qd[world] = 0.0
    target_angle = start_angle
    drawn_angle = wp.randf(random, settings.goal_lower, settings.goal_upper)
    if references.articulate[reference] != 0:
        target_angle = drawn_angle
    if goal_angle_fixed[world] >= 0.0:
        target_angle = goal_angle_fixed[world]
    set_object_goal(goal, world, object_pose, start_angle, target_offset[world], target_angle)
    start_counting(phase, world, object_pose)
    phase.index[world] = 0
    phase.decision_step[world] = 0
    phase.finished[world] = 0
    phase.retry_count[world] = 0

    for hand in range(references.active.shape[1]):
        # Drawn here, not in a function: a function would draw from a copy of the generator's state.
        reference_shift = settings.reference_position_noise * wp.vec3(
            wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0)
        )
        reference_turn = settings.reference_rotation_noise * wp.vec3(
            wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0)
        )
        wrist_in_part = offset_pose(references.wrist_pose_in_part[reference, hand], reference_shift, reference_turn)
        set_hand_goal(references, reference, wrist_in_part, settings.limit_margin, hand_model, goal, world, hand)
        for link in range(hand_state.contact_force.shape[2]):
            for part in range(hand_state.contact_force.shape[3]):
                hand_state.contact_force[world, hand, link, part] = wp.vec3()

        active = references.active[reference, hand] != 0
        distance = wp.where(active, settings.pregrasp_distance, settings.idle_distance)
        clearance = wp.where(active, settings.wrist_clearance, settings.idle_clearance)
        part_frame = part_pose(object_pose, hinge_origin, hinge_axis, start_angle, references.part[reference, hand])
        base = move_away(part_frame * wrist_in_part, wp.transform_get_translation(object_pose), distance, clearance)
        hand_state.hand_base[world, hand] = base
        position_noise = settings.position_noise * wp.vec3(
            wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0), wp.randf(random, -1.0, 1.0)
        )
        translation = wrist_noise(base, position_noise, settings.wrist_clearance)
        for dof in range(hand_state.joint_q.shape[2]):
            coordinate = wp.float32(0.0)
            if dof < 3:
                coordinate = translation[dof]
            else:
                if dof >= _WRIST_DOF_COUNT:
                    coordinate = settings.open_fraction * goal.finger_angles[world, hand, dof - _WRIST_DOF_COUNT]
                coordinate += wp.randf(random, -settings.angle_noise, settings.angle_noise)
            hand_state.joint_q[world, hand, dof] = coordinate
            hand_state.joint_qd[world, hand, dof] = 0.0
