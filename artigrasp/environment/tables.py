"""Assets, references and settings as the Warp structs that kernels read."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.assets.object import ObjectModel
from artigrasp.config import (
    ActionConfig,
    PhaseConfig,
    ResetConfig,
    RewardConfig,
    StageConfig,
)
from artigrasp.environment.action_columns import synergy_scales
from artigrasp.environment.worlds import WorldPlan
from artigrasp.errors import unknown
from artigrasp.kernels import actions, metrics, outcomes, phases, resets, rewards, states
from artigrasp.kernels.layout import ARTICULATED, HANDS
from artigrasp.kernels.synergies import finger_synergy_basis
from artigrasp.kernels.torques import DOF_GROUPS
from artigrasp.references.reference import ReferenceSet

WRIST_CLEARANCE, IDLE_CLEARANCE = 0.02, 0.2
"""Least height of a wrist over the table at the start [m], of hands that take part and those that wait: as high as
a hand is long, for they may point down."""

RUNAWAY_SPEED = 500.0
"""Speed of a joint or the object at which the physics of a world counts as failed [rad/s, m/s]."""

RUNAWAY_COORDINATE = 10.0
"""Joint coordinate of a hand at which it does [rad, m]; targets stay within 2.8 m and about half a turn."""

LOST_DISPLACEMENT = 2.0
"""Distance of the object from its start at which a world counts as failed [m]."""

LIMIT_MARGIN = 0.1
"""Room that the effective joint limits leave around a reference [rad]."""

PHASE_LIMITS: dict[str, float] = {
    "settle_steps": 10,
    "object_speed": 0.03,
    "object_turn_speed": 0.3,
    "position": 0.02,
    "rotation": 0.1,
    "hinge": 0.05,
    "wrist_position": 0.02,
    "wrist_rotation": 0.2,
    "placed_position": 0.04,
    "placed_rotation": 0.15,
    "drop_steps": 20,
    "slip": 0.1,
    "tilt": 0.7,
}
"""When a phase's aim counts as met and its object as lost, see `PhaseLimits`."""


def object_table(objects: Sequence[ObjectModel], worlds: WorldPlan, device: str) -> states.ObjectModel:
    """Hinge and masses of every world's object."""
    table = states.object_model(worlds.world_count, device)
    rows = worlds.object_index
    table.hinge_origin.assign(np.array([each.hinge_origin for each in objects], dtype=np.float32)[rows])
    table.hinge_axis.assign(np.array([each.hinge_axis for each in objects], dtype=np.float32)[rows])
    table.part_mass.assign(np.array([[p.mass for p in each.parts] for each in objects], dtype=np.float32)[rows])
    return table


def stand_on_stage(references: ReferenceSet, stage: StageConfig | None) -> ReferenceSet:
    """The references with those objects lifted that would otherwise stand inside the stage."""
    if stage is None:
        return references
    offset = references.object_pose[:, :2] - np.array(stage.position)
    over = (np.abs(offset) < 0.5 * np.array(stage.size)).all(axis=1)
    pose = references.object_pose.copy()
    pose[over, 2] += stage.height
    return replace(references, object_pose=pose)


def reference_table(
    references: Sequence[ReferenceSet],
    sides: Sequence[str],
    device: str,
    steadying: Sequence[NDArray[np.bool_]] | None = None,
) -> resets.ReferenceTable:
    """All references, one set after the other, cut down to the scene's hands.

    Args:
        references: The sets.
        sides: Sides of the hands.
        device: Warp device.
        steadying: Which hands steady the object in the references of each set, shape [R, 2]; none by default.
    """
    columns = [HANDS.index(side) for side in sides]

    def gather(name: str, dtype: object, per_hand: bool = True) -> wp.array:
        rows = np.concatenate([getattr(each, name) for each in references])
        rows = rows[:, columns] if per_hand else rows
        number = np.int32 if dtype is int else np.float32
        return wp.array(np.ascontiguousarray(rows, dtype=number), dtype=dtype, device=device)

    table = resets.ReferenceTable()
    kind = np.concatenate([each.kind for each in references])
    table.articulate = wp.array((kind == "articulate").astype(np.int32), dtype=int, device=device)
    table.active = gather("active", int)
    table.steadies = wp.zeros_like(table.active)
    if steadying is not None:
        table.steadies.assign(np.concatenate(steadying)[:, columns].astype(np.int32))
    table.part = gather("part", int)
    table.wrist_pose_in_part = gather("wrist_pose_in_part", wp.transform)
    table.finger_angles = gather("finger_angles", float)
    table.contacts = gather("contacts", float)
    table.object_pose = gather("object_pose", wp.transform, per_hand=False)
    table.object_angle = gather("object_angle", float, per_hand=False)
    return table


def reset_settings(config: ResetConfig, noise: bool) -> resets.ResetSettings:
    """How episodes start; without noise for measuring."""
    settings = resets.ResetSettings()
    settings.pregrasp_distance = config.pregrasp_distance
    settings.idle_distance = config.idle_distance
    settings.wrist_clearance, settings.idle_clearance = WRIST_CLEARANCE, IDLE_CLEARANCE
    settings.open_fraction = config.open_fraction
    settings.position_noise = config.position_noise if noise else 0.0
    settings.angle_noise = config.angle_noise if noise else 0.0
    settings.reference_position_noise = config.reference_position_noise if noise else 0.0
    settings.reference_rotation_noise = config.reference_rotation_noise if noise else 0.0
    settings.goal_lower, settings.goal_upper = config.goal_angle
    settings.limit_margin = LIMIT_MARGIN
    return settings


def reward_weights(config: RewardConfig) -> rewards.RewardWeights:
    """The kernel's weights; one weight serves the wrist's linear and angular velocity, as in the paper."""
    weights = rewards.RewardWeights()
    for name in states.field_names(rewards.RewardWeights):
        of_wrist = name in ("hand_linear_velocity", "hand_angular_velocity")
        setattr(weights, name, getattr(config, "hand_velocity" if of_wrist else name))
    return weights


def outcome_weights(config: RewardConfig, device: str) -> wp.array | None:
    """Weights of the outcome terms, or None if none of them counts."""
    weights = [getattr(config, name) for name in outcomes.OUTCOME_TERMS]
    return wp.array(weights, dtype=float, device=device) if config.rewards_outcome else None


def failure_limits() -> metrics.FailureLimits:
    """Thresholds of what counts as failed physics."""
    limits = metrics.FailureLimits()
    limits.speed = RUNAWAY_SPEED
    limits.coordinate = RUNAWAY_COORDINATE
    limits.displacement = LOST_DISPLACEMENT
    return limits


def object_mass(objects: Sequence[ObjectModel], worlds: WorldPlan, fixed_base: bool, device: str) -> wp.array:
    """Mass that caps the rewarded force [kg]: the articulated part's if the base is fixed, else the whole object's."""
    masses = np.array([[part.mass for part in each.parts] for each in objects])
    counted = masses[:, ARTICULATED] if fixed_base else masses.sum(axis=1)
    return wp.array(counted[worlds.object_index].astype(np.float32), dtype=float, device=device)


def action_settings(config: ActionConfig, reset: ResetConfig, control_dt: float) -> actions.ActionSettings:
    """Priors and scales; the scales of a term that is not in use are zero."""
    settings = actions.ActionSettings()
    settings.wrist_prior = actions.WRIST_PRIORS.index(config.wrist_prior)
    settings.finger_prior = actions.FINGER_PRIORS.index(config.finger_prior)
    settings.approach_steps, settings.approach_arc = config.approach_steps, config.approach_arc
    settings.close_start, settings.close_end = config.close_start, config.close_end
    settings.open_fraction = reset.open_fraction
    settings.squeeze, settings.press, settings.follow = config.squeeze, config.press, config.follow
    settings.lead = config.hinge_lead
    settings.lead_start, settings.lead_end = config.lead_start, config.lead_end
    settings.speed = config.carry_speed * control_dt
    settings.turn_speed = config.carry_turn_speed * control_dt
    settings.feedback = config.carry_feedback
    settings.retreat_distance = config.retreat_distance
    settings.pregrasp_distance, settings.idle_distance = reset.pregrasp_distance, reset.idle_distance
    settings.wrist_clearance, settings.idle_clearance = WRIST_CLEARANCE, IDLE_CLEARANCE
    if config.synergy is not None:
        settings.synergy_scale = actions.SynergyScale(*synergy_scales(config.synergy).values())
    if config.residual is not None:
        settings.residual_scale = wp.vec3(*(getattr(config.residual, group) for group in DOF_GROUPS))
    return settings


def phase_settings(configs: Sequence[PhaseConfig], reset: ResetConfig, control_dt: float, device: str) -> wp.array:
    """Priors and scales of every phase, shape [phase]."""
    rows = [action_settings(phase.action, reset, control_dt) for phase in configs]
    return wp.array(rows, dtype=actions.ActionSettings, device=device)


def phase_table(configs: Sequence[PhaseConfig], device: str) -> phases.PhaseTable:
    """What the phases of a sequence are for and how they end.

    Raises:
        UserError: A phase goes back to one that is not there.
    """
    names = [each.name for each in configs]
    for each in configs:
        if each.retry_from is not None and each.retry_from not in names:
            raise unknown("phase to try again from", each.retry_from, names)
    same = ("least_steps", "most_steps", "carries", "raises", "places", "drops", "steadies", "opens", "decides")
    columns: dict[str, tuple[Any, list[Any]]] = {
        **{name: (int, [int(getattr(each, name)) for each in configs]) for name in same},
        "reference": (int, [("first", "second").index(each.reference) for each in configs]),
        "aim": (int, [phases.AIMS.index(each.aim) for each in configs]),
        "lift": (float, [each.lift for each in configs]),
        "retry_from": (int, [-1 if each.retry_from is None else names.index(each.retry_from) for each in configs]),
        "stiffness": (float, [[group.kp for group in each.gains.groups] for each in configs]),
        "damping": (float, [[group.kd for group in each.gains.groups] for each in configs]),
    }
    table = phases.PhaseTable()
    for name, (dtype, values) in columns.items():
        number = np.int32 if dtype is int else np.float32
        setattr(table, name, wp.array(np.array(values, dtype=number), dtype=dtype, device=device))
    return table


def phase_limits(retry_count: int) -> phases.PhaseLimits:
    """When aims count as met and objects as lost."""
    limits = phases.PhaseLimits()
    for name, value in PHASE_LIMITS.items():
        setattr(limits, name, value)
    limits.retry_count = retry_count
    limits.limit_margin = LIMIT_MARGIN
    return limits


def synergy_basis(sides: Sequence[str], device: str) -> wp.array:
    """Finger angles per radian of each finger synergy, shape [hand, 5, 45]."""
    return wp.array(finger_synergy_basis(sides), dtype=float, device=device)
