"""Everything that defines one task: what is simulated, what an action means, what is rewarded, how it is learned."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from artigrasp.config.action import ActionConfig
from artigrasp.config.checks import (
    FieldError,
    require_fraction,
    require_name,
    require_not_negative,
    require_ordered_choice,
    require_positive,
)
from artigrasp.config.learning import PPOConfig
from artigrasp.config.physics import PDGains, PhysicsConfig
from artigrasp.config.replay import ReplayConfig
from artigrasp.config.reset import ResetConfig
from artigrasp.config.reward import RewardConfig
from artigrasp.config.stage import StageConfig

Side = Literal["left", "right"]
Kind = Literal["articulate", "grasp"]

MIRRORED = "mirrored"
"""Name of the network that acts for both hands, right ones as they are and left ones mirrored."""


@dataclass(frozen=True)
class TaskConfig:
    """One task; the defaults are the paper's first phase of the right hand."""

    name: str
    """Name on the command line: lower case words joined by hyphens."""
    description: str
    """One line for `artigrasp list tasks`."""
    hands: tuple[Side, ...] = ("right",)
    """Hands in the scene, left before right."""
    fixed_base: bool = True
    """Whether the object's base is fixed in space; if not, the object stands on the plane z = 0."""
    stage: StageConfig | None = None
    """A plateau that stands on the plane beside or under the object."""
    policies: Literal["per-hand", "mirrored"] = "per-hand"
    """Whether each hand has a policy and a learner of its own (the paper), or one policy acts for both and learns from
    both, to which a left hand is shown as its mirror image."""
    kinds: tuple[Kind, ...] = ("articulate",)
    """Kinds of references that the task draws from."""
    episode_steps: int = 300
    """Control steps per episode."""
    sequence: Literal["grasping"] | None = None
    """Sequence of `tasks.sequences` that an episode is in training, with targets in the air; None for a single phase,
    the task's own. The policy acts in the phases of its kinds."""
    practice: float = 0.0
    """Share of the episodes in training that play an object's references in proportion to how often they fail; the
    others play all alike."""
    include_hinge_features: bool = True
    """Whether the policy sees the hinge (the paper's I_art), which one ablation leaves out."""
    world_count: int = 2000
    """Worlds simulated at once in training."""
    iterations: int = 10_000
    """PPO iterations of a full training."""
    physics: PhysicsConfig = PhysicsConfig()
    """Time stepping and contact."""
    gains: PDGains = PDGains()
    """PD gains of the hands."""
    action: ActionConfig = ActionConfig()
    """What an action means."""
    reset: ResetConfig = ResetConfig()
    """How an episode starts."""
    reward: RewardConfig = RewardConfig()
    """What is rewarded."""
    ppo: PPOConfig = PPOConfig()
    """How it is learned; the network and the discount also where it is learned from replay."""
    replay: ReplayConfig | None = None
    """How it is learned from replay, in place of PPO; None for PPO."""

    def __post_init__(self) -> None:
        require_name(self, "name")
        require_positive(self, "episode_steps", "world_count")
        require_not_negative(self, "iterations")
        require_fraction(self, "practice")
        for name, term in self.action.terms.items():
            if self.episode_steps % term.decision_interval != 0:
                expected = f"a divisor of episode_steps ({self.episode_steps})"
                raise FieldError.mismatch(f"action.{name}.decision_interval", expected, term.decision_interval)
        require_ordered_choice(self, "hands", get_args(Side))
        require_ordered_choice(self, "kinds", get_args(Kind))
        least = math.ceil(max(self.ppo.mini_batches, 2) / (self.ppo.steps_per_env * len(self.hands)))
        if self.world_count < least:
            expected = f"at least {least}, for {self.ppo.mini_batches} mini-batches"
            raise FieldError.mismatch("world_count", expected, self.world_count)

    @property
    def networks(self) -> tuple[str, ...]:
        """Names of the policy's networks: the hands', or the one that acts for both."""
        return self.hands if self.policies == "per-hand" else (MIRRORED,)

    @property
    def control_dt(self) -> float:
        """Control step [s]."""
        return self.physics.control_dt
