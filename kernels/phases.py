"""The phases of a long motion: what they are for, when one ends and how (paper, Section Sequence Generation)."""

import warp as wp

from .goals import contact_strength, is_touching
from .poses import angle_between, distance_between, tilt_between
from .states import Goal, HandState, ObjectState, PhaseState

wp.set_module_options({"enable_backward": False})

AIMS = ("time", "grasp", "object", "hinge", "hands")
"""What ends a phase before its time: nothing; all hands that take part touch the object, which is at rest; the base is
where it should be, at rest; the hinge is where it should be; the wrists are where their targets are."""
_TIME, _GRASP, _OBJECT, _HINGE, _HANDS = (wp.constant(row) for row in range(len(AIMS)))

OUTCOMES = ("not begun", "running", "done", "not grasped", "not reached", "dropped", "slipped", "toppled")
"""What became of a phase. The last five are failures: the aim not met in time, or the object lost."""
FIRST_FAILURE = OUTCOMES.index("not grasped")
_RUNNING, _DONE, _NOT_GRASPED, _NOT_REACHED, _DROPPED, _SLIPPED, _TOPPLED = (
    wp.constant(row) for row in range(1, len(OUTCOMES))
)
_FIRST_FAILURE = wp.constant(FIRST_FAILURE)


@wp.struct
class PhaseTable:
    """The phases of a sequence, in order; ``P`` of them.

    Attributes:
        reference: [P] int, which of a world's references is played.
        aim: [P] int, index into `AIMS`.
        least_steps, most_steps: [P] int, control steps after which a phase may end and must end.
        carries: [P] int, 1 where the hands take the object to its goal, 0 where it should stay.
        lift: [P] height over the target where the object is carried to, m.
        raises: [P] int, 1 where the height is over where the phase began instead.
        places: [P] int, 1 where the phase fails if the object is not at its target in the end.
        drops: [P] int, 1 where the object may turn over, for it falls.
        steadies: [P] int, 1 where hands that take no part hold the base where their reference has them on it.
        opens: [P] int, 1 where the hinge should go to its target, 0 where it should stay as it was at the start.
        decides: [P] int, 1 where decisions count anew.
        retry_from: [P] int, the phase to go back to after a failure, -1 for none; where the object is carried, after it
            was dropped.
        stiffness, damping: [P, 3] gains of the `DOF_GROUPS`, N/m and N.m/rad, N.s/m and N.m.s/rad.
    """

    reference: wp.array[int]
    aim: wp.array[int]
    least_steps: wp.array[int]
    most_steps: wp.array[int]
    carries: wp.array[int]
    lift: wp.array[float]
    raises: wp.array[int]
    places: wp.array[int]
    drops: wp.array[int]
    steadies: wp.array[int]
    opens: wp.array[int]
    decides: wp.array[int]
    retry_from: wp.array[int]
    stiffness: wp.array2d[float]
    damping: wp.array2d[float]


@wp.struct
class PhaseLimits:
    """When an aim counts as met, and an object as lost.

    Attributes:
        settle_steps: control steps in a row in which an aim must be met.
        object_speed, object_turn_speed: of an object at rest, at most, m/s and rad/s.
        position, rotation: distance of the base from its goal, at most, m and rad.
        hinge: distance of the hinge from its goal, at most, rad.
        wrist_position, wrist_rotation: distance of a wrist from its target, at most, m and rad.
        placed_position, placed_rotation: distance of the base from its target where it was placed, at most, m and rad.
        drop_steps: control steps in a row without any touch after which a carried object counts as dropped.
        slip: distance of a carried object from its goal from which on it did not only miss it but slipped, m.
        tilt: of the base since the phase began, from which on a standing object counts as toppled, rad.
        retry_count: how often an episode may try again.
        limit_margin: room that the effective joint limits leave around the reference, rad.
    """

    settle_steps: int
    object_speed: float
    object_turn_speed: float
    position: float
    rotation: float
    hinge: float
    wrist_position: float
    wrist_rotation: float
    placed_position: float
    placed_rotation: float
    drop_steps: int
    slip: float
    tilt: float
    retry_count: int
    limit_margin: float


@wp.func
def untouching_hands(hand_state: HandState, goal: Goal, world: int) -> wp.vec2i:
    """Number of hands that take part, and of those among them that touch nothing of the object."""
    result = wp.vec2i(0, 0)
    for hand in range(goal.active.shape[1]):
        if goal.active[world, hand] != 0:
            touches = wp.float32(0.0)
            for link in range(goal.contacts.shape[2]):
                touches = wp.max(touches, is_touching(contact_strength(hand_state, goal, world, hand, link)))
            result += wp.vec2i(1, wp.where(touches > 0.0, 0, 1))
    return result


@wp.func
def wrists_arrived(
    hand_state: HandState, goal: Goal, target: wp.array3d[float], limits: PhaseLimits, world: int
) -> bool:
    """Whether all wrists that do not keep their PD targets are near them."""
    late = wp.int32(0)
    for hand in range(target.shape[1]):
        for dof in range(6):
            limit = wp.where(dof < 3, limits.wrist_position, limits.wrist_rotation)
            lag = wp.abs(target[world, hand, dof] - hand_state.joint_q[world, hand, dof])
            if goal.keeps[world, hand] == 0 and lag > limit:
                late += 1
    return late == 0


@wp.func
def is_near(pose: wp.transform, wanted: wp.transform, position: float, rotation: float) -> bool:
    """Whether a frame is less than a distance [m] and an angle [rad] from another."""
    return distance_between(pose, wanted) < position and angle_between(pose, wanted) < rotation


@wp.func
def is_aim_met(
    aim: int,
    untouching: int,
    hand_state: HandState,
    object_state: ObjectState,
    goal: Goal,
    target: wp.array3d[float],
    limits: PhaseLimits,
    world: int,
) -> bool:
    """Whether what an aim of `AIMS` asks for holds now; ``untouching``: hands that take part and touch nothing."""
    velocity = object_state.velocity[world]
    at_rest = (
        wp.length(wp.spatial_top(velocity)) < limits.object_speed
        and wp.length(wp.spatial_bottom(velocity)) < limits.object_turn_speed
    )
    met = False
    if aim == _GRASP:
        met = at_rest and untouching == 0
    elif aim == _OBJECT:
        pose, asked = object_state.pose[world], goal.object_pose[world]
        met = at_rest and is_near(pose, asked, limits.position, limits.rotation)
    elif aim == _HINGE:
        met = wp.abs(goal.angle[world] - object_state.hinge_q[world]) < limits.hinge
    elif aim == _HANDS:
        met = wrists_arrived(hand_state, goal, target, limits, world)
    return met


@wp.func
def how_it_ended(
    pose: wp.transform, goal: Goal, phase: PhaseState, table: PhaseTable, limits: PhaseLimits, world: int
) -> int:
    """What became of the running phase, index into `OUTCOMES`, with the base at ``pose``."""
    index = phase.index[world]
    aim = table.aim[index]
    ended = _RUNNING
    should_stand = table.carries[index] == 0 and table.drops[index] == 0
    if table.carries[index] != 0 and phase.untouched_steps[world] >= limits.drop_steps:
        ended = _DROPPED
    elif should_stand and tilt_between(phase.start_object_pose[world], pose) > limits.tilt:
        ended = _TOPPLED
    elif phase.settled_steps[world] >= limits.settle_steps and phase.step[world] >= table.least_steps[index]:
        ended = _DONE
    elif phase.step[world] >= table.most_steps[index]:
        ended = _DONE
        if aim == _GRASP:
            ended = _NOT_GRASPED
        elif aim == _OBJECT:
            ended = wp.where(distance_between(pose, goal.object_pose[world]) > limits.slip, _SLIPPED, _NOT_REACHED)
        elif aim == _HINGE:
            ended = _NOT_REACHED
    target = goal.target_object_pose[world]
    is_placed = is_near(pose, target, limits.placed_position, limits.placed_rotation)
    if ended == _DONE and table.places[index] != 0 and not is_placed:
        ended = _NOT_REACHED
    return ended


@wp.kernel
def advance_phases(
    hand_state: HandState,
    object_state: ObjectState,
    goal: Goal,
    target: wp.array3d[float],
    table: PhaseTable,
    limits: PhaseLimits,
    # outputs
    phase: PhaseState,
    outcome: wp.array2d[int],
    begins: wp.array[int],
):
    """End phases and move on to the next, or back to try again; launch with ``dim=W`` after the step was counted.

    Args:
        hand_state, object_state, goal: see `states`.
        target: [W, H, 51] PD targets, m and rad.
        table, limits: see there.
        phase: in and out.
        outcome: [W, P] int in and out, index into `OUTCOMES` of every phase in this episode.
        begins: [W] int output, 1 where another phase begins, which `phase_starts.begin_phases` must prepare.
    """
    world = wp.tid()
    begins[world] = 0
    index = phase.index[world]
    if phase.finished[world] != 0:
        return
    outcome[world, index] = _RUNNING
    hands = untouching_hands(hand_state, goal, world)
    phase.untouched_steps[world] = wp.where(hands[0] == hands[1], phase.untouched_steps[world] + 1, 0)

    met = is_aim_met(table.aim[index], hands[1], hand_state, object_state, goal, target, limits, world)
    phase.settled_steps[world] = wp.where(met, phase.settled_steps[world] + 1, 0)
    ended = how_it_ended(object_state.pose[world], goal, phase, table, limits, world)
    if ended == _RUNNING:
        return
    outcome[world, index] = ended
    back = table.retry_from[index]
    # hands that still hold the object had better go on than open
    failed = ended == _DROPPED or (ended >= _FIRST_FAILURE and table.carries[index] == 0)
    if failed and back >= 0 and phase.retry_count[world] < limits.retry_count:
        phase.retry_count[world] += 1
        phase.index[world] = back
        begins[world] = 1
    elif index + 1 < table.aim.shape[0]:
        phase.index[world] = index + 1
        begins[world] = 1
    else:
        phase.finished[world] = 1


@wp.kernel
def reset_outcomes(world_mask: wp.array[int], outcome: wp.array2d[int]):
    """Forget what became of the masked worlds' phases; launch with ``dim=W``."""
    world = wp.tid()
    if world_mask[world] == 0:
        return
    for phase in range(outcome.shape[1]):
        outcome[world, phase] = 0
