"""Settings of PPO (paper, the supplement's table of parameters)."""

from dataclasses import dataclass
from typing import Literal

from artigrasp.config.checks import FieldError, require_fraction, require_not_negative, require_positive


@dataclass(frozen=True)
class PPOConfig:
    """Hyper-parameters of PPO, the paper's by default; where the paper is silent, the authors' release."""

    steps_per_env: int = 300
    """Policy decisions per world and iteration."""
    epochs: int = 5
    """Passes over the collected data; with four batches each these are the paper's 20 updates."""
    mini_batches: int = 4
    """Batches per pass."""
    learning_rate: float = 5e-4
    """Step size of Adam, the first one if the schedule adapts it."""
    schedule: Literal["adaptive", "fixed"] = "adaptive"
    """Whether the learning rate follows the measured KL divergence."""
    desired_kl: float = 0.01
    """KL divergence per update that the adaptive schedule aims at."""
    gamma: float = 0.996
    """Discount per control step; a decision over k steps is discounted by its k-th power."""
    gae_lambda: float = 0.95
    """Decay of generalised advantage estimation."""
    clip: float = 0.2
    """Clipping range of the probability ratio and of the value."""
    value_coefficient: float = 0.5
    """Weight of the value loss."""
    entropy_coefficient: float = 0.0
    """Weight of the entropy bonus."""
    max_grad_norm: float = 0.5
    """Norm at which gradients are clipped."""
    observed_features: tuple[str, ...] = ()
    """Blocks of features that the networks see, by their names in `kernels/layout.py`; all if none is named. From few
    references a network learns more of less: what only tells them apart does not help with others."""
    hidden_sizes: tuple[int, ...] = (128, 128)
    """Units of each hidden layer, of actor and critic alike."""
    activation: Literal["elu", "leaky_relu", "relu", "tanh"] = "leaky_relu"
    """Activation of the hidden layers."""
    init_std: float = 1.0
    """Standard deviation of the action at the start."""
    normalize_observations: bool = False
    """Whether observations are scaled by their running mean and deviation."""
    save_interval: int = 50
    """Iterations between checkpoints."""
    evaluation_interval: int = 0
    """Iterations between evaluations of the policy without exploration; 0 for none."""
    evaluation_trials: int = 6
    """Trials of each object, and kind of its references, in an evaluation."""

    def __post_init__(self) -> None:
        require_positive(self, "steps_per_env", "epochs", "mini_batches", "learning_rate", "desired_kl", "clip")
        require_positive(self, "max_grad_norm", "init_std", "save_interval", "evaluation_trials")
        require_fraction(self, "gamma", "gae_lambda")
        require_not_negative(self, "value_coefficient", "entropy_coefficient", "evaluation_interval")
        if not self.hidden_sizes or min(self.hidden_sizes) < 1:
            raise FieldError.mismatch("hidden_sizes", "one or more positive whole numbers", self.hidden_sizes)
