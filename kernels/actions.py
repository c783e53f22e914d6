"""Actions to PD targets: a prior, slow synergy offsets and a fast residual, added up.

The paper's action (Section 4.2 and the authors' release) is ``WRIST_REFERENCE`` with ``FINGERS_CURRENT`` and the
residual alone. ``WRIST_HINGE`` with ``FINGERS_REFERENCE`` and no residual is the PD+IK baseline.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from .kinematics import part_pose
from .layout import DOFS, FINGER_DOF_COUNT, WRIST_DOF_COUNT
from .rotations import offset_pose, quat_to_euler_xyz_near, quat_to_rotation_vector, rotation_vector_to_quat
from .states import Goal, HandState, ObjectModel, ObjectState
from .torques import dof_group

wp.set_module_options({"enable_backward": False})

WRIST_REFERENCE, WRIST_HINGE = 0, 1
"""Wrist priors: the reference position on the part as it is, with the current rotation; or the reference pose on the
part as it will be a little nearer to the goal angle, approached from where the hand started."""
FINGERS_CURRENT, FINGERS_REFERENCE = 0, 1
"""Finger priors: the current angles; or angles that close from a fraction of the reference to the reference."""

FINGER_SYNERGIES = ("finger_flexion", "thumb1_x", "thumb1_y", "thumb1_z", "thumb_flexion")
WRIST_SYNERGIES = ("wrist_tx", "wrist_ty", "wrist_tz", "wrist_rx", "wrist_ry", "wrist_rz")
SYNERGIES = (*WRIST_SYNERGIES, *FINGER_SYNERGIES, "lead")
"""The 12 slow offsets: of the wrist in the manipulated part's frame, of the fingers, and of the lead on the hinge."""
SYNERGY_COUNT = len(SYNERGIES)

_WRIST_HINGE = wp.constant(WRIST_HINGE)
_FINGERS_REFERENCE = wp.constant(FINGERS_REFERENCE)
_WRIST_DOF_COUNT = wp.constant(WRIST_DOF_COUNT)
_FIRST_FINGER_SYNERGY = wp.constant(len(WRIST_SYNERGIES))
_LEAD = wp.constant(SYNERGIES.index("lead"))


def finger_synergy_basis(hands: Sequence[str], flexion_scale: float, thumb_scale: float) -> np.ndarray:
    """Change of the finger angles per unit of each finger synergy.

    Flexion turns about z, positive on a right hand; the two outer thumb joints flex about the axis midway between
    -y and z. Turns about y and z change sign on a left hand.

    Args:
        hands: sides in the scene's order, each ``"left"`` or ``"right"``.
        flexion_scale: common flexion of the four fingers, rad per unit.
        thumb_scale: each of the thumb's four offsets, rad per unit.

    Returns:
        [H, 5, 45] angles, rad per unit.
    """
    angles = DOFS[WRIST_DOF_COUNT:]
    basis = np.zeros((len(FINGER_SYNERGIES), FINGER_DOF_COUNT), dtype=np.float32)
    for column, name in enumerate(angles):
        if not name.startswith("thumb") and name.endswith("_rz"):
            basis[0, column] = flexion_scale
    for row, axis in enumerate("xyz", start=1):
        basis[row, angles.index(f"thumb1_r{axis}")] = thumb_scale
    for joint in ("thumb2", "thumb3"):
        basis[4, angles.index(f"{joint}_ry")] = -thumb_scale * np.sqrt(0.5)
        basis[4, angles.index(f"{joint}_rz")] = thumb_scale * np.sqrt(0.5)
    mirror = np.where([name.endswith("_rx") for name in angles], 1.0, -1.0)
    return np.stack([basis if hand == "right" else basis * mirror for hand in hands]).astype(np.float32)


@wp.struct
class ActionSettings:
    """How actions are scaled and which priors they are added to.

    Attributes:
        wrist_prior: `WRIST_REFERENCE` or `WRIST_HINGE`.
        finger_prior: `FINGERS_CURRENT` or `FINGERS_REFERENCE`.
        approach_steps: control steps over which `WRIST_HINGE` moves from the start pose to the reference.
        close_start, close_end: control steps between which `FINGERS_REFERENCE` closes.
        open_fraction: fraction of the reference angles before closing.
        lead: how far `WRIST_HINGE` runs ahead of the hinge towards the goal, at most, rad.
        lead_start, lead_end: control steps between which the lead grows from zero to its full size, so that the hand
            arrives and closes before it pulls.
        wrist_translation_scale, wrist_rotation_scale: m and rad per unit of a wrist synergy.
        lead_scale: rad per unit of the lead synergy.
        residual_scale: m, rad and rad per unit of the residual of each of `DOF_GROUPS`.
    """

    wrist_prior: int
    finger_prior: int
    approach_steps: float
    close_start: float
    close_end: float
    open_fraction: float
    lead: float
    lead_start: float
    lead_end: float
    wrist_translation_scale: float
    wrist_rotation_scale: float
    lead_scale: float
    residual_scale: wp.vec3


@wp.func
def fraction_between(value: float, start: float, end: float) -> float:
    """Where a value lies between start and end, in [0, 1]; a step at ``end`` when they are equal."""
    if value >= end:
        return 1.0
    return wp.clamp((value - start) / (end - start), 0.0, 1.0)


@wp.func
def blend_poses(start: wp.transform, end: wp.transform, fraction: float) -> wp.transform:
    """Straight line between positions and shortest turn between rotations."""
    start_rotation = wp.transform_get_rotation(start)
    turn = quat_to_rotation_vector(wp.quat_inverse(start_rotation) * wp.transform_get_rotation(end))
    return wp.transform(
        wp.lerp(wp.transform_get_translation(start), wp.transform_get_translation(end), fraction),
        start_rotation * rotation_vector_to_quat(fraction * turn),
    )


@wp.kernel
def pd_targets(
    hand_state: HandState,
    object_state: ObjectState,
    object_model: ObjectModel,
    goal: Goal,
    settings: ActionSettings,
    synergy_basis: wp.array3d[float],
    step: wp.array[int],
    synergy: wp.array3d[float],
    residual: wp.array3d[float],
    target: wp.array3d[float],
):
    """PD targets of every hand; launch with ``dim=(W, H)``.

    The wrist target is relative to the hand base, its angles are the ones nearest to the current ones, and all are
    clamped to the goal's effective limits. A hand that takes no part holds the pose in which it was reset.

    Args:
        hand_state, object_state, object_model, goal: see `states`.
        settings: priors and scales.
        synergy_basis: [H, 5, 45] of `finger_synergy_basis`.
        step: [W] control steps since the reset.
        synergy: [W, H, 12] offsets in units of their scales, order `SYNERGIES`.
        residual: [W, H, 51] offsets in units of their scales.
        target: [W, H, 51] output, m and rad.
    """
    world, hand = wp.tid()
    now = float(step[world])
    active = goal.active[world, hand]
    finger_dof_count = goal.finger_angles.shape[2]

    # Wrist: the reference on the part, seen from the base.
    part = goal.part[world, hand]
    angle = object_state.hinge_q[world]
    if settings.wrist_prior == _WRIST_HINGE:
        lead = wp.max(settings.lead + settings.lead_scale * synergy[world, hand, _LEAD], 0.0)
        lead = lead * fraction_between(now, settings.lead_start, settings.lead_end)
        angle = angle + wp.clamp(goal.angle[world] - angle, -lead, lead)
    part_in_world = part_pose(
        object_state.pose[world], object_model.hinge_origin[world], object_model.hinge_axis[world], angle, part
    )
    wrist_in_part = offset_pose(
        goal.wrist_pose_in_part[world, hand],
        settings.wrist_translation_scale
        * wp.vec3(synergy[world, hand, 0], synergy[world, hand, 1], synergy[world, hand, 2]),
        settings.wrist_rotation_scale
        * wp.vec3(synergy[world, hand, 3], synergy[world, hand, 4], synergy[world, hand, 5]),
    )
    wrist_in_base = wp.transform_inverse(hand_state.hand_base[world, hand]) * part_in_world * wrist_in_part
    current_angles = wp.vec3(
        hand_state.joint_q[world, hand, 3], hand_state.joint_q[world, hand, 4], hand_state.joint_q[world, hand, 5]
    )
    wrist_angles = current_angles
    if settings.wrist_prior == _WRIST_HINGE:
        # The base frame is the pose in which the hand was reset.
        reached = fraction_between(now, 0.0, settings.approach_steps)
        smooth = reached * reached * (3.0 - 2.0 * reached)
        wrist_in_base = blend_poses(wp.transform_identity(), wrist_in_base, smooth)
        wrist_angles = quat_to_euler_xyz_near(wp.transform_get_rotation(wrist_in_base), current_angles)
    wrist_translation = wp.transform_get_translation(wrist_in_base)
    if active == 0:
        wrist_translation = wp.vec3(0.0, 0.0, 0.0)
        wrist_angles = wp.vec3(0.0, 0.0, 0.0)
    for axis in range(3):
        target[world, hand, axis] = wrist_translation[axis]
        target[world, hand, 3 + axis] = wrist_angles[axis]

    closed = settings.open_fraction
    if active != 0:
        closed = wp.lerp(closed, 1.0, fraction_between(now, settings.close_start, settings.close_end))
    for finger_dof in range(finger_dof_count):
        dof = _WRIST_DOF_COUNT + finger_dof
        if active == 0 or settings.finger_prior == _FINGERS_REFERENCE:
            target[world, hand, dof] = closed * goal.finger_angles[world, hand, finger_dof]
        else:
            target[world, hand, dof] = hand_state.joint_q[world, hand, dof]
        if active != 0:
            offset = wp.float32(0.0)
            for row in range(synergy_basis.shape[1]):
                offset += synergy[world, hand, _FIRST_FINGER_SYNERGY + row] * synergy_basis[hand, row, finger_dof]
            target[world, hand, dof] += offset

    for dof in range(target.shape[2]):
        value = target[world, hand, dof]
        if active != 0:
            value += settings.residual_scale[dof_group(dof)] * residual[world, hand, dof]
        target[world, hand, dof] = wp.clamp(value, goal.lower[world, hand, dof], goal.upper[world, hand, dof])
