"""Actions to PD targets: a prior, slow synergy offsets and a fast residual, added up.

The paper's action (Section 4.2 and the authors' release) is the wrist prior "reference" with the finger prior "current"
and the residual alone. "hinge" with "reference" and no residual is the PD+IK baseline. The other priors are those of
the phases between and after grasps (Section 5, Sequence Generation).
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import warp as wp

from .layout import HANDS, KEYPOINTS, WRIST_DOF_COUNT
from .poses import blend_poses, offset_pose, shift_pose
from .rotations import quat_to_euler_xyz_near
from .states import Goal, HandState, ObjectModel, ObjectState, PhaseState
from .synergies import SYNERGIES, SYNERGY_COUNT, WRIST_SYNERGIES
from .torques import dof_group
from .wrist_priors import (
    correct_pose,
    fraction_between,
    manipulated_part_pose_at,
    move_around,
    move_away,
    move_out,
    move_over,
    planned_object_pose,
    smooth_step,
)

wp.set_module_options({"enable_backward": False})

WRIST_PRIORS = ("reference", "hinge", "schedule", "transport", "retreat", "transit", "home")
"""Wrist priors.

- reference: the reference position on the part as it is, with the current rotation;
- hinge: the reference pose on the part as it will be a little nearer to the goal angle, approached from where the hand
  began the phase;
- schedule: the same on the part as it should be by now, wherever the hinge is, the angle being raised with time;
- transport: the pose in which the hand began the phase, carried along with the object on its way to its goal;
- retreat: out of the grip, halfway between straight away from the object and where the hand's back and wrist look;
- transit: around the object to where the reference is approached from, or where a hand that takes no part waits;
- home: up and over to where the hand waited when all began.
"""
FINGER_PRIORS = ("current", "reference", "closed", "opening")
"""Finger priors: the current angles; angles that close from open to the reference; the reference; angles that open
again."""

if TYPE_CHECKING:
    SynergyScale: TypeAlias = wp.vec4  # a type checker cannot count its numbers
else:
    SynergyScale = wp.types.vector(length=SYNERGY_COUNT, dtype=float)

_REFERENCE, _HINGE, _SCHEDULE, _TRANSPORT, _RETREAT, _TRANSIT, _HOME = map(wp.constant, range(len(WRIST_PRIORS)))
_CURRENT, _CLOSING, _CLOSED, _OPENING = (wp.constant(row) for row in range(len(FINGER_PRIORS)))
_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)
_FIRST_FINGER_SYNERGY = wp.constant(len(WRIST_SYNERGIES))
_LEAD, _SQUEEZE, _PRESS = (wp.constant(SYNERGIES.index(name)) for name in ("lead", "squeeze", "press"))
_PALM = wp.constant(KEYPOINTS.index("middle1"))


def hand_backs(hands: Sequence[str]) -> np.ndarray:
    """Directions in which hands draw back from what is before palm and fingertips, in the wrist's frame.

    Args:
        hands: sides in the scene's order, each ``"left"`` or ``"right"``.

    Returns:
        [H, 3] unit vectors.
    """
    # a right hand's fingers point to -x and its palm to -y
    back = np.sqrt(0.5) * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]], dtype=np.float32)
    return back[[HANDS.index(hand) for hand in hands]]


@wp.struct
class ActionSettings:
    """How actions are scaled in a phase and which priors they are added to.

    Attributes:
        wrist_prior: index into `WRIST_PRIORS`.
        finger_prior: index into `FINGER_PRIORS`.
        approach_steps: control steps over which the wrist moves from where it began the phase: to the reference with
            the priors hinge and schedule, back with retreat, around with transit, over with home.
        approach_arc: how far the way of the priors hinge and schedule bows to the back and wrist of the hand, which so
            comes in with palm and fingertips, m.
        close_start, close_end: control steps between which the fingers close or open.
        open_fraction: fraction of the reference angles of open fingers.
        squeeze: how far closed fingers are asked to flex beyond the reference, rad.
        press: how far a wrist is moved onto what it holds as the fingers close, m: towards the other hand if both take
            part, else to where its palm looks.
        follow: share of what the base has moved away from where it should be that the reference moves along with the
            priors hinge and schedule; with 1 it stays on the object, with 0 the object has to stay.
        lead: how far the prior hinge runs ahead of the hinge towards the goal, at most, rad.
        lead_start, lead_end: control steps between which the lead grows from zero to its full size, so that the hand
            arrives and closes before it pulls; with the prior schedule those between which the angle is raised from
            the start to the goal.
        speed, turn_speed: of the prior transport, m and rad per control step.
        feedback: share of what the object lags behind its planned pose that the prior transport adds.
        retreat_distance: of the prior retreat, m.
        pregrasp_distance, idle_distance: from the reference where the prior transit ends, m, for hands that take part
            and those that do not.
        wrist_clearance, idle_clearance: least height of the wrist over the table with the priors retreat and transit,
            m; the second where hands wait.
        synergy_scale: m or rad per unit of each of `SYNERGIES`, zero for those that are not in use.
        residual_scale: m, rad and rad per unit of the residual of each of `DOF_GROUPS`.
    """

    wrist_prior: int
    finger_prior: int
    approach_steps: float
    approach_arc: float
    close_start: float
    close_end: float
    open_fraction: float
    squeeze: float
    press: float
    follow: float
    lead: float
    lead_start: float
    lead_end: float
    speed: float
    turn_speed: float
    feedback: float
    retreat_distance: float
    pregrasp_distance: float
    idle_distance: float
    wrist_clearance: float
    idle_clearance: float
    synergy_scale: SynergyScale
    residual_scale: wp.vec3


@wp.func
def closed_fraction(settings: ActionSettings, now: float, engaged: int) -> float:
    """How far the fingers of a hand should be closed, from 0, which is open, to 1."""
    closed = fraction_between(now, settings.close_start, settings.close_end)
    if settings.finger_prior == _CLOSED:
        closed = 1.0
    elif settings.finger_prior == _OPENING:
        closed = 1.0 - closed
    return wp.where(engaged != 0, closed, 0.0)


@wp.func
def press_direction(hand_state: HandState, goal: Goal, wrist: wp.transform, world: int, hand: int) -> wp.vec3:
    """Unit vector along which a hand presses: to the palm of the other hand if both take part, else where it looks."""
    direction = wp.quat_rotate(wp.transform_get_rotation(wrist), wp.vec3(0.0, -1.0, 0.0))
    for other in range(goal.active.shape[1]):
        if other != hand and goal.active[world, hand] != 0 and goal.active[world, other] != 0:
            direction = wp.normalize(hand_state.keypoint[world, other, _PALM] - hand_state.keypoint[world, hand, _PALM])
    return direction


@wp.func
def wrist_reference(
    hand_state: HandState,
    object_state: ObjectState,
    object_model: ObjectModel,
    goal: Goal,
    settings: ActionSettings,
    now: float,
    synergy: wp.array3d[float],
    world: int,
    hand: int,
) -> wp.transform:
    """The reference wrist frame in the world, with its synergies, on the part as it is or a little ahead."""
    base = object_state.pose[world]
    angle = object_state.hinge_q[world]
    if settings.wrist_prior == _HINGE or settings.wrist_prior == _SCHEDULE:
        base = blend_poses(goal.object_pose[world], base, settings.follow)
    if settings.wrist_prior == _HINGE:
        lead = wp.max(settings.lead + settings.synergy_scale[_LEAD] * synergy[world, hand, _LEAD], 0.0)
        lead = lead * fraction_between(now, settings.lead_start, settings.lead_end)
        angle = angle + wp.clamp(goal.angle[world] - angle, -lead, lead)
    elif settings.wrist_prior == _SCHEDULE:
        raised = fraction_between(now, settings.lead_start, settings.lead_end)
        end = goal.angle[world] + settings.synergy_scale[_LEAD] * synergy[world, hand, _LEAD]
        angle = wp.lerp(goal.start_angle[world], end, raised)
    shift, turn = wp.vec3(), wp.vec3()
    for axis in range(3):
        shift[axis] = settings.synergy_scale[axis] * synergy[world, hand, axis]
        turn[axis] = settings.synergy_scale[3 + axis] * synergy[world, hand, 3 + axis]
    wrist_in_part = offset_pose(goal.wrist_pose_in_part[world, hand], shift, turn)
    return manipulated_part_pose_at(base, object_model, goal, world, hand, angle) * wrist_in_part


@wp.func
def wrist_prior(
    reference: wp.transform,
    hand_state: HandState,
    object_state: ObjectState,
    goal: Goal,
    phase: PhaseState,
    settings: ActionSettings,
    hand_back: wp.array[wp.vec3],
    home: wp.array2d[wp.transform],
    now: float,
    world: int,
    hand: int,
) -> wp.transform:
    """Where the prior takes the wrist, in the world, from the reference and from where the hand began the phase."""
    start = hand_state.hand_base[world, hand]
    origin = wp.transform_get_translation(object_state.pose[world])
    target = start
    if settings.wrist_prior == _TRANSPORT:
        plan = planned_object_pose(phase, goal, world, now, settings.speed, settings.turn_speed)
        target = plan * wp.transform_inverse(phase.start_object_pose[world]) * start
        if goal.engaged[world, hand] != 0:
            target = correct_pose(target, object_state.pose[world], plan, settings.feedback)
    elif settings.wrist_prior == _TRANSIT:
        engaged = goal.engaged[world, hand] != 0
        distance = wp.where(engaged, settings.pregrasp_distance, settings.idle_distance)
        clearance = wp.where(engaged, settings.wrist_clearance, settings.idle_clearance)
        end = move_away(reference, origin, distance, clearance)
        target = move_around(start, end, origin, smooth_step(now, settings.approach_steps), settings.wrist_clearance)
    elif goal.engaged[world, hand] != 0:
        if settings.wrist_prior == _RETREAT:
            start_origin = wp.transform_get_translation(phase.start_object_pose[world])
            distance = settings.retreat_distance * smooth_step(now, settings.approach_steps)
            target = move_out(start, start_origin, hand_back[hand], distance, settings.wrist_clearance)
        elif settings.wrist_prior == _HOME:
            target = move_over(start, home[world, hand], smooth_step(now, settings.approach_steps))
        elif settings.wrist_prior == _HINGE or settings.wrist_prior == _SCHEDULE:
            reached = smooth_step(now, settings.approach_steps)
            target = blend_poses(start, reference, reached)
            back = wp.quat_rotate(wp.transform_get_rotation(target), hand_back[hand])
            target = shift_pose(target, settings.approach_arc * 4.0 * reached * (1.0 - reached) * back)
        else:
            target = reference
    return target


@wp.kernel
def pd_targets(
    hand_state: HandState,
    object_state: ObjectState,
    object_model: ObjectModel,
    goal: Goal,
    phase: PhaseState,
    phase_settings: wp.array[ActionSettings],
    synergy_basis: wp.array3d[float],
    hand_back: wp.array[wp.vec3],
    home: wp.array2d[wp.transform],
    synergy: wp.array3d[float],
    residual: wp.array3d[float],
    target: wp.array3d[float],
):
    """PD targets of every hand; launch with ``dim=(W, H)``.

    The wrist target is relative to the hand base, its angles are the ones nearest to the current ones, and all are
    clamped to the goal's effective limits. A hand that is not engaged stays where it began the phase, unless the prior
    carries it along with the object or takes it to where it waits. One that keeps its targets is left alone.

    Args:
        hand_state, object_state, object_model, goal, phase: see `states`.
        phase_settings: [P] priors and scales of every phase.
        synergy_basis: [H, 5, 45] of `synergies.finger_synergy_basis`.
        hand_back: [H] of `hand_backs`.
        home: [W, H] wrist frames in the world to which the prior home leads.
        synergy: [W, H, 14] offsets in units of their scales, order `SYNERGIES`.
        residual: [W, H, 51] offsets in units of their scales.
        target: [W, H, 51] output, m and rad.
    """
    world, hand = wp.tid()
    if goal.keeps[world, hand] != 0:
        return
    settings = phase_settings[phase.index[world]]
    now = float(phase.step[world])
    active, engaged = goal.active[world, hand], goal.engaged[world, hand]
    finger_dof_count = goal.finger_angles.shape[2]

    reference = wrist_reference(hand_state, object_state, object_model, goal, settings, now, synergy, world, hand)
    closed = closed_fraction(settings, now, engaged)
    wrist = wrist_prior(reference, hand_state, object_state, goal, phase, settings, hand_back, home, now, world, hand)
    press = settings.press + settings.synergy_scale[_PRESS] * synergy[world, hand, _PRESS]
    wrist = shift_pose(wrist, closed * press * press_direction(hand_state, goal, wrist, world, hand))
    squeeze = settings.squeeze + settings.synergy_scale[_SQUEEZE] * synergy[world, hand, _SQUEEZE]
    wrist_in_base = wp.transform_inverse(hand_state.hand_base[world, hand]) * wrist
    current_angles = wp.vec3(
        hand_state.joint_q[world, hand, 3], hand_state.joint_q[world, hand, 4], hand_state.joint_q[world, hand, 5]
    )
    wrist_translation = wp.transform_get_translation(wrist_in_base)
    wrist_angles = quat_to_euler_xyz_near(wp.transform_get_rotation(wrist_in_base), current_angles)
    if engaged != 0 and settings.wrist_prior == _REFERENCE:
        wrist_angles = current_angles
    for axis in range(3):
        target[world, hand, axis] = wrist_translation[axis]
        target[world, hand, 3 + axis] = wrist_angles[axis]

    for finger_dof in range(finger_dof_count):
        dof = _WRIST_DOF_COUNT + finger_dof
        if engaged != 0 and settings.finger_prior == _CURRENT:
            target[world, hand, dof] = hand_state.joint_q[world, hand, dof]
        else:
            fraction = wp.lerp(settings.open_fraction, 1.0, closed)
            target[world, hand, dof] = fraction * goal.finger_angles[world, hand, finger_dof]
        if active != 0:
            offset = squeeze * closed * synergy_basis[hand, 0, finger_dof]
            for row in range(synergy_basis.shape[1]):
                column = _FIRST_FINGER_SYNERGY + row
                decided = settings.synergy_scale[column] * synergy[world, hand, column]
                offset += decided * synergy_basis[hand, row, finger_dof]
            target[world, hand, dof] += offset

    for dof in range(target.shape[2]):
        value = target[world, hand, dof]
        if active != 0:
            value += settings.residual_scale[dof_group(dof)] * residual[world, hand, dof]
        target[world, hand, dof] = wp.clamp(value, goal.lower[world, hand, dof], goal.upper[world, hand, dof])
