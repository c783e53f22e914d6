"""Settings of the synthesis of references."""

from dataclasses import dataclass

from artigrasp.config.checks import require_not_negative, require_positive


@dataclass(frozen=True)
class SynthesisConfig:
    """How many hands are tried, and what weighs what. A term is a sum of squares of errors over their scales."""

    candidates: int = 32
    """Hands, or pairs of them, that are optimised for each kind of grip."""
    draws: int = 12
    """Intents drawn for each of them, of which the best start counts."""
    iterations: int = 100
    """Steps of the optimiser."""
    seed: int = 0
    """Seed of the intents."""
    samples: int = 2500
    """Points of the object's surface that fingers may be meant for."""
    anchor: float = 1.0
    """Weight of the distance of each busy fingertip from the point that it is meant for."""
    anchor_scale: float = 0.015
    """Scale of that distance [m]."""
    contact: float = 4.0
    """Weight of the gap between busy fingertips and the surface, squared near it and linear far from it."""
    contact_scale: float = 0.003
    """Scale of that gap [m]."""
    penetration: float = 1.0
    """Weight of the depth of the hands in the object, and of forearms in the object and the table."""
    penetration_scale: float = 0.002
    """Scale of that depth [m]."""
    penetration_allowed: float = 0.0005
    """Depth that counts as touching [m]."""
    forearm_scale: float = 0.01
    """Scale of the depth of forearms [m]."""
    table: float = 1.0
    """Weight of what the hands lack in clearance from the table."""
    table_clearance: float = 0.003
    """Least height of the hands over the table [m]."""
    overlap: float = 1.0
    """Weight of the depth of links in other links, of either hand."""
    overlap_scale: float = 0.003
    """Scale of that depth [m]."""
    pads: float = 1.0
    """Weight of busy fingertips that meet the surface with anything but their pad."""
    balance: float = 2.0
    """Weight of the force and the torque about the centre of mass that are left if busy fingertips press evenly."""
    leverage: float = 2.0
    """Weight of how much nearer to the hinge than they could be the fingertips open it."""
    limits: float = 1.0
    """Weight of finger angles beyond the hand's joint limits."""
    limits_scale: float = 0.05
    """Scale of what they exceed the limits by [rad]."""
    natural: float = 0.3
    """Weight of the distance from natural finger angles, in their standard deviations."""
    tries: int = 4
    """Grips that the physics is asked about for each reference that is wanted, at most."""
    trials: int = 1
    """Trials of each of them: angles to open to, or targets to lift to."""
    rollouts: int = 8
    """Rollouts of the search that grips are given which PD+IK fails with, if too few work, as many grips as references
    are wanted; 0 for none."""

    def __post_init__(self) -> None:
        require_positive(self, "candidates", "draws", "iterations", "samples", "tries", "trials")
        require_positive(self, "anchor_scale", "contact_scale", "penetration_scale", "forearm_scale", "overlap_scale")
        require_positive(self, "limits_scale")
        require_not_negative(self, "seed", "rollouts", "penetration_allowed", "table_clearance")
        require_not_negative(self, "anchor", "contact", "penetration", "table", "overlap", "pads", "balance")
        require_not_negative(self, "leverage", "limits", "natural")
