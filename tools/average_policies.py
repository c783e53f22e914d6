"""Put the policies of several trainings together: one that decides what they decide on average.

    python tools/average_policies.py POLICY [POLICY ...] OUT

Policies of one task, from other seeds, err in other ways where references are unlike those of the training; their mean
errs less. The networks stand side by side in one that is as much wider, so that the policy is one like any other.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch

from artigrasp.controllers.network import build_actor
from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.errors import UserError
from tools.exits import exits_on_error

State = dict[str, torch.Tensor]


def average(policies: Sequence[PolicyFile]) -> PolicyFile:
    """The policy that decides what these decide on average.

    Raises:
        UserError: They are for different things.
    """
    first = policies[0]
    for each in policies[1:]:
        for name in ("hands", "action", "kinds", "sequence", "include_hinge_features", "ppo"):
            if getattr(each.task, name) != getattr(first.task, name):
                raise UserError(f"{name}: expected policies of one task, found different ones")
        if each.hand != first.hand:
            raise UserError(f"hand: expected policies for {first.hand}, found one for {each.hand}")
    ppo = first.task.ppo
    wide = replace(ppo, hidden_sizes=tuple(len(policies) * size for size in ppo.hidden_sizes))
    return replace(
        first,
        task=replace(first.task, ppo=wide),
        objects=tuple(dict.fromkeys(name for each in policies for name in each.objects)),
        control_steps=sum(each.control_steps for each in policies),
        wall_time=sum(each.wall_time for each in policies),
        actors={name: _average_actor([each.actors[name] for each in policies], first) for name in first.actors},
        learner=None,
    )


def _average_actor(actors: Sequence[State], policy: PolicyFile) -> State:
    """Networks side by side, which see what the first one's normaliser makes of the features."""
    slack = getattr(build_actor(policy.task.ppo, len(actors[0]["distribution.std_param"])).obs_normalizer, "eps", 0.0)
    layers = sorted({int(name.split(".")[1]) for name in actors[0] if name.startswith("mlp.")})
    result = dict(actors[0])
    for layer in layers:
        weights = [each[f"mlp.{layer}.weight"] for each in actors]
        biases = [each[f"mlp.{layer}.bias"] for each in actors]
        if layer == layers[0]:
            seen = [_renormalized(*pair, actors[0], slack) for pair in zip(weights, actors, strict=True)]
            biases = [bias + shift for bias, (_, shift) in zip(biases, seen, strict=True)]
            weight, bias = torch.cat([scaled for scaled, _ in seen]), torch.cat(biases)
        elif layer == layers[-1]:
            weight, bias = torch.cat(weights, dim=1) / len(actors), torch.stack(biases).mean(dim=0)
        else:
            weight, bias = torch.block_diag(*weights), torch.cat(biases)  # type: ignore[no-untyped-call]
        result |= {f"mlp.{layer}.weight": weight, f"mlp.{layer}.bias": bias}
    return result


def _renormalized(weight: torch.Tensor, own: State, shown: State, slack: float) -> tuple[torch.Tensor, torch.Tensor]:
    """First weights of a network, and what is added to its bias, for features that another's normaliser has scaled."""
    if "obs_normalizer._mean" not in own:
        return weight, torch.zeros(len(weight))
    scale = own["obs_normalizer._std"] + slack
    shift = (shown["obs_normalizer._mean"] - own["obs_normalizer._mean"]) / scale
    return weight * ((shown["obs_normalizer._std"] + slack) / scale), (weight @ shift.T)[:, 0]


def main() -> None:
    """Read, put together and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", type=Path, nargs="+", metavar="POLICY")
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    with exits_on_error(parser):
        save_policy(average([load_policy(path) for path in options.policies]), options.out)


if __name__ == "__main__":
    main()
