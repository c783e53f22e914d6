"""Several policies as one."""

from dataclasses import replace

import pytest
import torch
from tensordict import TensorDict

from artigrasp.config import PPOConfig
from artigrasp.controllers.network import OBSERVATION_GROUP, build_actor, observed_columns
from artigrasp.controllers.policy_file import PolicyFile
from artigrasp.errors import UserError
from artigrasp.tasks import get_task
from tools.average_policies import average

ACTIONS = 12


def policy(seed: int, ppo: PPOConfig) -> PolicyFile:
    """One with random weights, that has seen features of its own mean and deviation."""
    torch.manual_seed(seed)
    task = replace(get_task("right-free-replay"), ppo=ppo)
    actor = build_actor(ppo, ACTIONS)
    actor.train()
    actor.update_normalization(seen(100, ppo, scale=1.0 + seed, shift=float(seed)))
    for name, weights in actor.named_parameters():
        if name.endswith("bias"):
            torch.nn.init.normal_(weights)
    names, actors = ("box", f"other{seed}"), {"right": actor.state_dict()}
    return PolicyFile(task, "mano", names, seed, iteration=1, control_steps=10, wall_time=1.0, actors=actors)


def seen(count: int, ppo: PPOConfig, *, scale: float = 1.0, shift: float = 0.0) -> TensorDict:
    """Random features."""
    features = scale * torch.randn(count, len(observed_columns(ppo))) + shift
    return TensorDict({OBSERVATION_GROUP: features}, batch_size=count)


def decide(policy: PolicyFile, features: TensorDict) -> torch.Tensor:
    """What a policy does."""
    actor = build_actor(policy.task.ppo, ACTIONS)
    actor.load_state_dict(policy.actors["right"])
    actor.eval()
    return torch.as_tensor(actor(features))


@pytest.mark.parametrize("normalize", [True, False])
def test_it_decides_what_they_decide_on_average(normalize: bool) -> None:
    """In one network, whatever each of them has been normalised with."""
    ppo = replace(get_task("right-free-replay").ppo, normalize_observations=normalize)
    policies = [policy(seed, ppo) for seed in range(3)]
    together, features = average(policies), seen(20, ppo)
    expected = torch.stack([decide(each, features) for each in policies]).mean(dim=0)
    torch.testing.assert_close(decide(together, features), expected, rtol=1e-4, atol=1e-4)
    assert together.objects == ("box", "other0", "other1", "other2")
    assert together.control_steps == 30 and together.task.ppo.hidden_sizes == (384, 384)


def test_policies_for_different_things_are_refused() -> None:
    """By what differs."""
    ppo = get_task("right-free-replay").ppo
    first, second = policy(0, ppo), policy(1, ppo)
    with pytest.raises(UserError, match="kinds"):
        average([first, replace(second, task=replace(second.task, kinds=("grasp",)))])
    with pytest.raises(UserError, match="hand"):
        average([first, replace(second, hand="open")])
