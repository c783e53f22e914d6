"""What happened in an episode, gathered at every control step, and episodes that must be ended."""

import warp as wp

from .poses import angle_between, distance_between, tilt_between
from .states import Goal, HandState, ObjectState, element_types

wp.set_module_options({"enable_backward": False})

FAILURES = ("not_finite", "runaway", "lost_object", "diverged", "overflow")
"""Bits of `EpisodeMetrics.failure`: a state that is no number, joints or object too fast or joints too far, object far
from its start, physics that gave up and began anew, contacts or constraints that were dropped for want of room."""
NOT_FINITE, RUNAWAY, LOST_OBJECT, DIVERGED, OVERFLOW = (wp.constant(1 << bit) for bit in range(len(FAILURES)))
_FAILURE_COUNT = wp.constant(len(FAILURES))


@wp.struct
class EpisodeMetrics:
    """Measurements of the running episode, all [W]; without unit: rad.

    Attributes:
        step_count: int, control steps measured.
        angle: hinge angle, now.
        displacement: distance of the base frame's origin from its start, now, m.
        displacement_max, displacement_mean: the same over the episode, m.
        tilt_max: angle between the base's start direction of up and up, over the episode; turning about the vertical
            is no tilt.
        angle_change_max: absolute change of the hinge angle since the start, over the episode.
        angle_error: absolute distance of the hinge angle from its target, now.
        angle_error_mean, angle_error_min: the same over the episode.
        lift: height of the base frame's origin over its start, now, m.
        turn: angle between the base and its start, now.
        position_error: distance of the base frame's origin from its target, now, m.
        position_error_mean, position_error_min: the same over the episode, m.
        rotation_error: angle between the base and its target, now.
        rotation_error_min: the same over the episode.
        failure: int, bits of `FAILURES`, kept until the reset.
    """

    step_count: wp.array[int]
    angle: wp.array[float]
    displacement: wp.array[float]
    displacement_max: wp.array[float]
    displacement_mean: wp.array[float]
    tilt_max: wp.array[float]
    angle_change_max: wp.array[float]
    angle_error: wp.array[float]
    angle_error_mean: wp.array[float]
    angle_error_min: wp.array[float]
    lift: wp.array[float]
    turn: wp.array[float]
    position_error: wp.array[float]
    position_error_mean: wp.array[float]
    position_error_min: wp.array[float]
    rotation_error: wp.array[float]
    rotation_error_min: wp.array[float]
    failure: wp.array[int]


@wp.struct
class FailureLimits:
    """From where on physics counts as failed.

    Attributes:
        speed: largest believable speed of any joint or of the object's base, m/s and rad/s.
        coordinate: largest believable joint coordinate of a hand, m and rad.
        displacement: distance from its start at which the object counts as lost, m.
    """

    speed: float
    coordinate: float
    displacement: float


def episode_metrics(world_count: int, device: str | None = None) -> EpisodeMetrics:
    """Zeroed `EpisodeMetrics`."""
    metrics = EpisodeMetrics()
    for name, dtype in element_types(EpisodeMetrics).items():
        setattr(metrics, name, wp.zeros(world_count, dtype=dtype, device=device))
    return metrics


@wp.func
def failure_bits(
    hand_state: HandState, object_state: ObjectState, limits: FailureLimits, displacement: float, world: int
) -> int:
    """Bits of `FAILURES` that hold in a world now."""
    position = wp.transform_get_translation(object_state.pose[world])
    rotation = wp.transform_get_rotation(object_state.pose[world])
    finite = wp.isfinite(position) and wp.isfinite(rotation) and wp.isfinite(object_state.velocity[world])
    fastest = wp.abs(object_state.hinge_qd[world])
    fastest = wp.max(fastest, wp.length(wp.spatial_top(object_state.velocity[world])))
    fastest = wp.max(fastest, wp.length(wp.spatial_bottom(object_state.velocity[world])))
    magnitude = wp.abs(object_state.hinge_q[world])
    farthest = wp.float32(0.0)
    for hand in range(hand_state.joint_q.shape[1]):
        for dof in range(hand_state.joint_q.shape[2]):
            # Sums, since max() may drop what is no number.
            coordinate = wp.abs(hand_state.joint_q[world, hand, dof])
            magnitude += coordinate
            farthest = wp.max(farthest, coordinate)
            speed = wp.abs(hand_state.joint_qd[world, hand, dof])
            magnitude += speed
            fastest = wp.max(fastest, speed)
    bits = 0
    if not (finite and wp.isfinite(magnitude + object_state.hinge_qd[world])):
        bits = bits | NOT_FINITE
    if fastest > limits.speed or farthest > limits.coordinate:
        bits = bits | RUNAWAY
    if displacement > limits.displacement:
        bits = bits | LOST_OBJECT
    return bits


@wp.kernel
def reset_metrics(world_mask: wp.array[int], goal: Goal, metrics: EpisodeMetrics):
    """Forget the episodes of the masked worlds; launch with ``dim=W`` after `reset_worlds`.

    Hinge and base count as measured at their start: that is what remains of an episode that fails at once.

    Args:
        world_mask: [W] int, 1 where an episode starts.
        goal: see `states`.
        metrics: output.
    """
    world = wp.tid()
    if world_mask[world] == 0:
        return
    angle_error = wp.abs(goal.target_angle[world] - goal.start_angle[world])
    position_error = distance_between(goal.start_object_pose[world], goal.target_object_pose[world])
    rotation_error = angle_between(goal.start_object_pose[world], goal.target_object_pose[world])
    metrics.step_count[world] = 0
    metrics.angle[world] = goal.start_angle[world]
    metrics.displacement[world] = 0.0
    metrics.displacement_max[world] = 0.0
    metrics.displacement_mean[world] = 0.0
    metrics.tilt_max[world] = 0.0
    metrics.angle_change_max[world] = 0.0
    metrics.angle_error[world] = angle_error
    metrics.angle_error_mean[world] = angle_error
    metrics.angle_error_min[world] = angle_error
    metrics.lift[world] = 0.0
    metrics.turn[world] = 0.0
    metrics.position_error[world] = position_error
    metrics.position_error_mean[world] = position_error
    metrics.position_error_min[world] = position_error
    metrics.rotation_error[world] = rotation_error
    metrics.rotation_error_min[world] = rotation_error
    metrics.failure[world] = 0


@wp.kernel
def update_metrics(
    hand_state: HandState,
    object_state: ObjectState,
    goal: Goal,
    diverged: wp.array[int],
    overflow_count: wp.array[int],
    limits: FailureLimits,
    metrics: EpisodeMetrics,
    failure_count: wp.array[int],
):
    """Take in one control step; launch with ``dim=W``. Section "Metrics" of the paper.

    From the first failure on the measurements stay as they were before it.

    Args:
        hand_state, object_state, goal: see `states`; the start is the goal's.
        diverged, overflow_count: [W] int, see ``simulation.state``.
        limits: see `FailureLimits`.
        metrics: in and out.
        failure_count: [failure] int, in and out: episodes in which each of `FAILURES` happened.
    """
    world = wp.tid()
    start = goal.start_object_pose[world]
    pose = object_state.pose[world]
    displacement = distance_between(start, pose)
    bits = failure_bits(hand_state, object_state, limits, displacement, world)
    if diverged[world] != 0:
        bits = bits | DIVERGED
    if overflow_count[world] != 0:
        bits = bits | OVERFLOW
    before = metrics.failure[world]
    for bit in range(_FAILURE_COUNT):
        if ((bits & ~before) >> bit) & 1 != 0:
            wp.atomic_add(failure_count, bit, 1)
    metrics.failure[world] = before | bits
    if metrics.failure[world] != 0:
        return

    tilt = tilt_between(start, pose)
    angle = object_state.hinge_q[world]
    angle_change = wp.abs(angle - goal.start_angle[world])
    angle_error = wp.abs(goal.target_angle[world] - angle)
    position_error = distance_between(pose, goal.target_object_pose[world])
    rotation_error = angle_between(pose, goal.target_object_pose[world])
    step_count = metrics.step_count[world] + 1
    weight = 1.0 / float(step_count)
    metrics.step_count[world] = step_count
    metrics.angle[world] = angle
    metrics.displacement[world] = displacement
    metrics.displacement_max[world] = wp.max(metrics.displacement_max[world], displacement)
    metrics.displacement_mean[world] = wp.lerp(metrics.displacement_mean[world], displacement, weight)
    metrics.tilt_max[world] = wp.max(metrics.tilt_max[world], tilt)
    metrics.angle_change_max[world] = wp.max(metrics.angle_change_max[world], angle_change)
    metrics.angle_error[world] = angle_error
    metrics.angle_error_mean[world] = wp.lerp(metrics.angle_error_mean[world], angle_error, weight)
    metrics.angle_error_min[world] = wp.min(metrics.angle_error_min[world], angle_error)
    metrics.lift[world] = wp.transform_get_translation(pose)[2] - wp.transform_get_translation(start)[2]
    metrics.turn[world] = angle_between(start, pose)
    metrics.position_error[world] = position_error
    metrics.position_error_mean[world] = wp.lerp(metrics.position_error_mean[world], position_error, weight)
    metrics.position_error_min[world] = wp.min(metrics.position_error_min[world], position_error)
    metrics.rotation_error[world] = rotation_error
    metrics.rotation_error_min[world] = wp.min(metrics.rotation_error_min[world], rotation_error)
