"""The actor network as rsl-rl builds it."""

from typing import Any

import torch
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from artigrasp.config import PPOConfig
from artigrasp.errors import unknown
from artigrasp.kernels.layout import FEATURE_COUNT, FEATURES, SUB_BLOCKS, feature_slice

OBSERVATION_GROUP = "policy"
"""The one observation group; actor and critic see the same features."""

OBSERVATION_SETS = {"actor": [OBSERVATION_GROUP], "critic": [OBSERVATION_GROUP]}


def observed_columns(ppo: PPOConfig) -> list[int]:
    """Columns of the features that the networks see.

    Raises:
        UserError: There is no block of a name.
    """
    names = [*(each.name for each in FEATURES), *SUB_BLOCKS]
    for name in ppo.observed_features:
        if name not in names:
            raise unknown("observed feature", name, names)
    columns = range(FEATURE_COUNT)
    return [column for name in ppo.observed_features for column in columns[feature_slice(name)]] or list(columns)


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


def build_actor(ppo: PPOConfig, action_count: int) -> MLPModel:
    """An untrained actor, which sees the observed columns of the features."""
    settings = {key: value for key, value in actor_settings(ppo).items() if key != "class_name"}
    example = TensorDict({OBSERVATION_GROUP: torch.zeros(1, len(observed_columns(ppo)))}, batch_size=1)
    return MLPModel(example, dict(OBSERVATION_SETS), "actor", action_count, **settings)
