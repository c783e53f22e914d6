"""Weights of the reward (paper, section "Reward" and the supplement's table of parameters)."""

from dataclasses import dataclass, fields

from artigrasp.config.checks import require_not_negative


@dataclass(frozen=True)
class RewardConfig:
    """Weights of the reward terms, the paper's by default; a weight of zero leaves its term out.

    Errors and velocities are subtracted, contacts are added; the signs belong to the terms, so no weight is negative.
    """

    keypoint: float = 3.0
    """w_px: squared position error of each joint keypoint [1/m2]."""
    fingertip: float = 12.0
    """w_px of the five fingertips [1/m2]."""
    pose: float = 0.2
    """w_pq: norm of the wrist rotation and finger angle error [1/rad]."""
    contact: float = 1.5
    """w_cc: fraction of the target contacts that are made."""
    force: float = 1.5
    """w_cf: force on the target contacts, capped [1/N]."""
    force_cap: float = 5.0
    """lambda: cap of that force per kilogram of the object [N/kg]."""
    hand_velocity: float = 0.5
    """w_rh: squared linear and angular velocity of the wrist."""
    object_velocity: float = 0.2
    """w_ro: squared velocity of the object, hinge included."""
    angle: float = 1.5
    """w_tq: hinge angle error [1/rad]."""
    displacement: float = 0.2
    """w_tx: squared distance of the base from where it began [1/m2]."""
    outcome_error: float = 0.0
    """Hinge angle error at the end of the episode [1/rad]; not in the paper."""
    outcome_mean_error: float = 0.0
    """Hinge angle error averaged over the episode [1/rad]; not in the paper."""
    outcome_success: float = 0.0
    """Success at the end of the episode; not in the paper."""
    outcome_displacement: float = 0.0
    """Distance of the base from its start averaged over the episode [1/m]; not in the paper."""
    outcome_lift: float = 0.0
    """Whether the object is lifted at the end of the episode; not in the paper."""
    outcome_position_error: float = 0.0
    """Distance of the base from its target at the end, up to 0.5 m [1/m]; not in the paper."""
    outcome_rotation_error: float = 0.0
    """Angle between the base and its target at the end, up to 0.5 rad [1/rad]; not in the paper."""

    def counts(self, term: str) -> bool:
        """Whether a term of the reward counts; the keypoints' comprises the fingertips'."""
        weights = ("keypoint", "fingertip") if term == "keypoint" else (term,)
        return any(getattr(self, weight) for weight in weights)

    @property
    def rewards_outcome(self) -> bool:
        """Whether an outcome term counts, which makes the end of an episode part of the task and no mere time limit."""
        return any(getattr(self, field.name) for field in fields(self) if field.name.startswith("outcome_"))

    def __post_init__(self) -> None:
        require_not_negative(self, *(field.name for field in fields(self)))
