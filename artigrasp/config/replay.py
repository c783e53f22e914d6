"""Settings of learning from replay: every decision that was ever tried is learned from again."""

from dataclasses import dataclass

from artigrasp.config.checks import require_fraction, require_not_negative, require_positive


@dataclass(frozen=True)
class ReplayConfig:
    """Hyper-parameters of the actor and its critics; sizes are those of small problems: few, expensive decisions."""

    critic_count: int = 5
    """Critics, which differ in their initial weights and in what they leave out of each batch."""
    critic_size: int = 128
    """Units of each of a critic's two hidden layers."""
    dropout: float = 0.2
    """Share of a critic's hidden units that learn nothing from a batch."""
    weight_decay: float = 0.1
    """Decoupled weight decay of actor and critics."""
    critic_rate: float = 1e-3
    """Step size of Adam for the critics."""
    actor_rate: float = 5e-4
    """Step size of Adam for the actor."""
    updates: int = 200
    """Batches that the critics learn from per iteration; the actor learns from every second one."""
    batch_size: int = 256
    """Decisions in a batch."""
    random_iterations: int = 8
    """Iterations at the start in which decisions are drawn at random, with the initial deviation of PPO."""
    random_share: float = 1.0
    """Share of the decisions that are drawn then; the others are zero."""
    exploration: float = 0.4
    """Standard deviation of what is tried around the actor's decision."""
    candidate_count: int = 8
    """Candidates drawn for each decision, of which one critic, drawn as well, chooses the one to try."""
    doubt: float = 0.5
    """Standard deviations between the critics that the actor subtracts from their mean."""
    action_cost: float = 0.004
    """Cost of the square of each action, which keeps the actor near the prior where nothing speaks against it."""
    average_rate: float = 0.01
    """Share by which the actor that acts, and critics that judge what follows, approach those that learn, per batch."""

    def __post_init__(self) -> None:
        require_positive(self, "critic_count", "critic_size", "critic_rate", "actor_rate", "updates", "batch_size")
        require_positive(self, "candidate_count", "average_rate")
        require_not_negative(self, "weight_decay", "random_iterations", "exploration", "doubt", "action_cost")
        require_fraction(self, "dropout", "average_rate", "random_share")
