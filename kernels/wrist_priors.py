"""Where a wrist goes by itself: along the hinge, with the object, away from it, around it. All frames: world; m."""

import warp as wp

from .kinematics import part_pose
from .poses import blend_poses, distance_between, turn_between
from .rotations import quat_to_rotation_vector, rotation_vector_to_quat
from .states import Goal, ObjectModel, PhaseState

wp.set_module_options({"enable_backward": False})

RISE = wp.constant(0.15)
"""Of a path that leads up and over, midway [m]."""
ARC_HEIGHT = wp.constant(0.1)
"""How much farther from the object a wrist that goes around to its other side passes [m]."""
CORRECTION_SHIFT = wp.constant(0.05)
"""How far a wrist is moved at most to make up for an object that lags behind its planned pose [m]."""
CORRECTION_TURN = wp.constant(0.2)
"""How far it is turned for that at most [rad]."""


@wp.func
def fraction_between(value: float, start: float, end: float) -> float:
    """Where a value lies between start and end, in [0, 1]; a step at ``end`` when they are equal."""
    if value >= end:
        return 1.0
    return wp.clamp((value - start) / (end - start), 0.0, 1.0)


@wp.func
def smooth_step(value: float, end: float) -> float:
    """From 0 to 1 between zero and ``end``, without a jump in speed."""
    fraction = fraction_between(value, 0.0, end)
    return fraction * fraction * (3.0 - 2.0 * fraction)


@wp.func
def shortened(vector: wp.vec3, limit: float) -> wp.vec3:
    """The vector, or as much of it as is no longer than a limit."""
    return vector * (limit / wp.max(wp.length(vector), limit))


@wp.func
def correct_pose(pose: wp.transform, found: wp.transform, wanted: wp.transform, share: float) -> wp.transform:
    """A frame moved, and turned about the wanted origin, by a share of what leads from a found to a wanted frame.

    It goes no farther than ``CORRECTION_SHIFT`` and ``CORRECTION_TURN``: hands that chase what tips over throw it.
    """
    origin = wp.transform_get_translation(wanted)
    shift = shortened(share * (origin - wp.transform_get_translation(found)), CORRECTION_SHIFT)
    rotation = rotation_vector_to_quat(shortened(share * turn_between(found, wanted), CORRECTION_TURN))
    arm = wp.quat_rotate(rotation, wp.transform_get_translation(pose) - origin)
    return wp.transform(origin + arm + shift, rotation * wp.transform_get_rotation(pose))


@wp.func
def direction_from(origin: wp.vec3, position: wp.vec3) -> wp.vec3:
    """Unit vector from an origin to a position; up, if they are the same."""
    direction = wp.vec3(0.0, 0.0, 1.0)
    if wp.length(position - origin) > 0.0:
        direction = wp.normalize(position - origin)
    return direction


@wp.func
def move_along(wrist: wp.transform, direction: wp.vec3, distance: float, clearance: float) -> wp.transform:
    """The wrist frame moved along a unit vector, kept above the table."""
    position = wp.transform_get_translation(wrist) + distance * direction
    return wp.transform(
        wp.vec3(position[0], position[1], wp.max(position[2], clearance)), wp.transform_get_rotation(wrist)
    )


@wp.func
def move_away(wrist: wp.transform, origin: wp.vec3, distance: float, clearance: float) -> wp.transform:
    """The wrist frame moved straight away from an origin (up, if it is there), kept above the table."""
    return move_along(wrist, direction_from(origin, wp.transform_get_translation(wrist)), distance, clearance)


@wp.func
def move_out(
    wrist: wp.transform, origin: wp.vec3, hand_back: wp.vec3, distance: float, clearance: float
) -> wp.transform:
    """The wrist frame moved out of its grip, kept above the table.

    Its way is halfway between straight away from an origin, which alone would drag along what the fingers are around,
    and the hand's own back, and never leads down.
    """
    away = direction_from(origin, wp.transform_get_translation(wrist))
    way = away + wp.quat_rotate(wp.transform_get_rotation(wrist), hand_back)
    way = wp.vec3(way[0], way[1], wp.max(way[2], 0.0))
    return move_along(wrist, direction_from(wp.vec3(), way), distance, clearance)


@wp.func
def move_around(
    start: wp.transform, end: wp.transform, origin: wp.vec3, fraction: float, clearance: float
) -> wp.transform:
    """A wrist frame on the way from start to end that keeps its distance from an origin, passing above it.

    Direction from and distance to the origin go over separately. The farther the two directions are apart, the more
    the path rises over the origin and away from it. It is kept above the table.
    """
    start_offset = wp.transform_get_translation(start) - origin
    end_offset = wp.transform_get_translation(end) - origin
    start_direction = direction_from(wp.vec3(), start_offset)
    end_direction = direction_from(wp.vec3(), end_offset)
    bow = 2.0 * fraction * (1.0 - fraction) * (1.0 - wp.dot(start_direction, end_direction))
    direction = wp.lerp(start_direction, end_direction, fraction) + wp.vec3(0.0, 0.0, bow)
    distance = wp.lerp(wp.length(start_offset), wp.length(end_offset), fraction) + ARC_HEIGHT * bow
    position = origin + distance * direction_from(wp.vec3(), direction)
    return wp.transform(
        wp.vec3(position[0], position[1], wp.max(position[2], clearance)),
        wp.transform_get_rotation(blend_poses(start, end, fraction)),
    )


@wp.func
def move_over(start: wp.transform, end: wp.transform, fraction: float) -> wp.transform:
    """A wrist frame on the way from start to end that rises first and then goes across.

    So it comes out of a box without catching on its walls or its lid.
    """
    low, high = wp.transform_get_translation(start), wp.transform_get_translation(end)
    across = wp.lerp(low, high, fraction * fraction)
    rise = wp.lerp(low[2], high[2], fraction) + 4.0 * RISE * fraction * (1.0 - fraction)
    return wp.transform(
        wp.vec3(across[0], across[1], rise), wp.transform_get_rotation(blend_poses(start, end, fraction * fraction))
    )


@wp.func
def planned_object_pose(
    phase: PhaseState, goal: Goal, world: int, now: float, speed: float, turn_speed: float
) -> wp.transform:
    """Where the base should be on its way from where the phase began to its goal.

    Args:
        phase, goal: see `states`.
        world: the world.
        now: control steps since the phase began.
        speed, turn_speed: mean speeds, m and rad per control step; the slower of the two sets the pace.
    """
    start, end = phase.start_object_pose[world], goal.object_pose[world]
    turn = quat_to_rotation_vector(wp.quat_inverse(wp.transform_get_rotation(start)) * wp.transform_get_rotation(end))
    duration = wp.max(distance_between(start, end) / speed, wp.length(turn) / turn_speed)
    return blend_poses(start, end, smooth_step(now, duration))


@wp.func
def manipulated_part_pose_at(
    base: wp.transform, object_model: ObjectModel, goal: Goal, world: int, hand: int, angle: float
) -> wp.transform:
    """Frame of the part that a hand manipulates, if the base and the hinge [rad] were there."""
    return part_pose(
        base,
        object_model.hinge_origin[world],
        object_model.hinge_axis[world],
        angle,
        goal.part[world, hand],
    )
