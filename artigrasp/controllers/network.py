"""The actor network as rsl-rl builds it."""

from typing import Any

import torch
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from artigrasp.config import PPOConfig

OBSERVATION_GROUP = "policy"
"""The one observation group; actor and critic see the same features."""

OBSERVATION_SETS = {"actor": [OBSERVATION_GROUP], "critic": [OBSERVATION_GROUP]}


def critic_settings(ppo: PPOConfig) -> dict[str, Any]:
    """rsl-rl's settings of the critic."""
    return {
        "class_name": "MLPModel",
        "hidden_dims": list(ppo.hidden_sizes),
        "activation": {"leaky_relu": "lrelu"}.get(ppo.activation, ppo.activation),
        "obs_normalization": ppo.normalize_observations,
    }


def actor_settings(ppo: PPOConfig) -> dict[str, Any]:
    """rsl-rl's settings of the actor: the critic's, and a Gaussian of constant deviation on top."""
    distribution = {"class_name": "GaussianDistribution", "init_std": ppo.init_std}
    return {**critic_settings(ppo), "distribution_cfg": distribution}


def build_actor(ppo: PPOConfig, observation_count: int, action_count: int) -> MLPModel:
    """An untrained actor for inference."""
    settings = {key: value for key, value in actor_settings(ppo).items() if key != "class_name"}
    example = TensorDict({OBSERVATION_GROUP: torch.zeros(1, observation_count)}, batch_size=1)
    return MLPModel(example, dict(OBSERVATION_SETS), "actor", action_count, **settings)
