"""Learning from replay: an actor that climbs an ensemble of critics, which learn from all decisions that were tried.

Where an episode holds few decisions, each costs far more to simulate than to learn from, and PPO forgets each after one
iteration. Here all are kept. The critics predict what a decision earns until the episode's end; the actor's is the one
that they value most, less what they disagree about. What is tried next is the best of some candidates around it in the
eyes of one critic, drawn for each row: Thompson sampling.
"""

import copy
import itertools
from collections.abc import Mapping
from typing import Any

import torch
from rsl_rl.models import MLPModel
from tensordict import TensorDict
from torch import nn

from artigrasp.config import PPOConfig, ReplayConfig
from artigrasp.controllers.network import OBSERVATION_GROUP, build_actor

COLUMNS = ("observation", "action", "reward", "next_observation", "is_last")
"""What is kept of every decision."""


class Critics(nn.Module):
    """Several networks side by side, each with two hidden layers, that value decisions."""

    def __init__(self, count: int, input_count: int, size: int, dropout: float) -> None:
        """Draw the initial weights."""
        super().__init__()
        sizes = (input_count, size, size, 1)
        self.weights = nn.ParameterList(
            torch.randn(count, before, after) * before**-0.5 for before, after in itertools.pairwise(sizes)
        )
        self.biases = nn.ParameterList(torch.zeros(count, 1, after) for after in sizes[1:])
        self._dropout = dropout

    def forward(self, observations: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Values [critic, row] of decisions [row, action] in observations [row, observation]."""
        inputs = torch.cat([observations, actions], dim=-1)
        hidden = inputs.expand(len(self.weights[0]), *inputs.shape)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            hidden = nn.functional.layer_norm(torch.baddbmm(bias, hidden, weight), weight.shape[-1:])
            hidden = nn.functional.dropout(torch.relu(hidden), self._dropout, self.training)
        return torch.baddbmm(self.biases[-1], hidden, self.weights[-1])[..., 0]


class Replay:
    """Actor, critics and everything that was tried; used as rsl-rl's PPO is, whose methods it shares.

    Attributes:
        actor: The network that acts, as PPO's: the running average of the one that learns.
        iteration: Iterations done.
    """

    def __init__(
        self, replay: ReplayConfig, ppo: PPOConfig, gamma: float, observation_count: int, action_count: int
    ) -> None:
        """Build the networks, which draws from PyTorch's random generator.

        Args:
            replay: How it learns.
            ppo: Shape of the actor, and the deviation of random decisions.
            gamma: Discount per decision.
            observation_count, action_count: What the actor sees and decides.
        """
        self.settings, self.gamma = replay, gamma
        self.actor: MLPModel = build_actor(ppo, action_count)
        inputs = observation_count + action_count
        self.critics = Critics(replay.critic_count, inputs, replay.critic_size, replay.dropout)
        self._target_critics = copy.deepcopy(self.critics)
        self._init_std, self._action_count, self.iteration = ppo.init_std, action_count, 0
        self._learning_actor = copy.deepcopy(self.actor.mlp)
        decay = replay.weight_decay
        self._actor_optimizer = torch.optim.AdamW(
            self._learning_actor.parameters(), lr=replay.actor_rate, weight_decay=decay
        )
        self._critic_optimizer = torch.optim.AdamW(self.critics.parameters(), lr=replay.critic_rate, weight_decay=decay)
        self._memory: list[tuple[torch.Tensor, ...]] = []
        self._pending: tuple[torch.Tensor, ...] | None = None
        self._decision: tuple[torch.Tensor, torch.Tensor] | None = None

    def train_mode(self) -> None:
        """Let networks learn."""
        self.actor.train()

    def act(self, observations: TensorDict) -> torch.Tensor:
        """Decisions [row, action] to try."""
        rows = observations[OBSERVATION_GROUP]
        self._follow(rows)
        if self.iteration < self.settings.random_iterations:
            self.actor.update_normalization(observations)
            drawn = torch.rand(len(rows), 1) < self.settings.random_share
            actions = drawn * self._init_std * torch.randn(len(rows), self._action_count)
        else:
            actions = self._explore(self.actor.obs_normalizer(rows))
        self._decision = (rows, actions)
        return actions

    def process_env_step(
        self, observations: TensorDict, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, torch.Tensor]
    ) -> None:
        """Keep what the last decisions led to, except where the physics failed or a hand takes no part.

        Args:
            observations: Not looked at; what follows is seen by the next :meth:`act` or :meth:`compute_returns`.
            rewards, dones: [row]
            extras: ``time_outs``, 1 where an episode was cut short, and ``active``, 1 where a hand takes part, [row].
        """
        assert self._decision is not None
        keep = (extras["time_outs"] == 0) & (extras["active"] != 0)
        self._pending = (*self._decision, rewards, dones.float(), keep)

    def compute_returns(self, observations: TensorDict) -> None:
        """Close the collection with what follows it."""
        self._follow(observations[OBSERVATION_GROUP])

    def update(self) -> dict[str, float]:
        """Learn from batches of everything that was kept.

        Returns:
            The losses of critics and actor, means over the batches.
        """
        self._memory = [tuple(torch.cat(column) for column in zip(*self._memory, strict=True))]
        observations, actions, rewards, following, is_last = self._memory[0]
        with torch.no_grad():
            observations, following = self.actor.obs_normalizer(observations), self.actor.obs_normalizer(following)
        # with few decisions, many batches would learn them by heart
        share = min(1.0, len(rewards) / (8 * self.settings.batch_size))
        count = max(2, round(share * self.settings.updates))
        critic_losses, actor_losses = [], []
        for number in range(count):
            batch = torch.randint(len(rewards), (self.settings.batch_size,))
            seen = observations[batch]
            returns = self._returns(rewards[batch], following[batch], is_last[batch])
            critic_losses.append(self._learn_critics(seen, actions[batch], returns))
            if number % 2 == 0:
                actor_losses.append(self._learn_actor(seen))
        self.iteration += 1
        return {"critic": sum(critic_losses) / len(critic_losses), "actor": sum(actor_losses) / len(actor_losses)}

    def state_dict(self) -> dict[str, Any]:
        """Everything but the actor."""
        return {
            "learning_actor": self._learning_actor.state_dict(),
            "critics": self.critics.state_dict(),
            "target_critics": self._target_critics.state_dict(),
            "actor_optimizer": self._actor_optimizer.state_dict(),
            "critic_optimizer": self._critic_optimizer.state_dict(),
            "memory": dict(zip(COLUMNS, self._memory[0], strict=True)),
            "iteration": self.iteration,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take up :meth:`state_dict`; the actor is loaded by itself."""
        self._learning_actor.load_state_dict(state["learning_actor"])
        self.critics.load_state_dict(state["critics"])
        self._target_critics.load_state_dict(state["target_critics"])
        self._actor_optimizer.load_state_dict(state["actor_optimizer"])
        self._critic_optimizer.load_state_dict(state["critic_optimizer"])
        # how fast it learns is a setting, and not part of the state
        for optimizer, rate in (
            (self._actor_optimizer, self.settings.actor_rate),
            (self._critic_optimizer, self.settings.critic_rate),
        ):
            for group in optimizer.param_groups:
                group["lr"] = rate
        self._memory = [tuple(state["memory"][name] for name in COLUMNS)]
        self.iteration = int(state["iteration"])

    def remember(self, memory: Mapping[str, torch.Tensor]) -> None:
        """Take what others have tried, the ``COLUMNS``, for all that was, and see features as they come there."""
        observations = TensorDict({OBSERVATION_GROUP: memory["observation"]}, batch_size=len(memory["reward"]))
        self.actor.update_normalization(observations)
        self._memory = [tuple(memory[name] for name in COLUMNS)]

    def learn_on_from_actor(self) -> None:
        """Learn on from the weights that the actor was given: no random decisions before that."""
        self._learning_actor.load_state_dict(self.actor.mlp.state_dict())
        self.iteration = max(self.iteration, self.settings.random_iterations)

    def _explore(self, seen: torch.Tensor) -> torch.Tensor:
        """The best of the actor's decision and candidates around it in the eyes of one critic for each row."""
        count, rows = self.settings.candidate_count, len(seen)
        noise = self.settings.exploration * torch.randn(rows, count, self._action_count)
        noise[:, 0] = 0.0
        candidates = self.actor.mlp(seen)[:, None] + noise
        self.critics.train()
        repeated = seen[:, None].expand(-1, count, -1).flatten(0, 1)
        values = self.critics(repeated, candidates.flatten(0, 1)).unflatten(1, (rows, count))
        row = torch.arange(rows)
        judge = torch.randint(len(values), (rows,))
        chosen: torch.Tensor = candidates[row, values[judge, row].argmax(dim=1)]
        return chosen

    def _follow(self, rows: torch.Tensor) -> None:
        """Complete what is pending with the observations that follow it."""
        if self._pending is not None:
            observations, actions, rewards, dones, keep = self._pending
            kept = (observations, actions, rewards, rows, dones)
            self._memory.append(tuple(each[keep].clone() for each in kept))
        self._pending = None

    def _returns(self, rewards: torch.Tensor, following: torch.Tensor, is_last: torch.Tensor) -> torch.Tensor:
        """What decisions earned, and are expected to earn after that, [row]."""
        if bool(is_last.all()):
            return rewards
        with torch.no_grad():
            values: torch.Tensor = self._target_critics(following, self.actor.mlp(following)).mean(dim=0)
        return rewards + self.gamma * (1.0 - is_last) * values

    def _learn_critics(self, seen: torch.Tensor, actions: torch.Tensor, returns: torch.Tensor) -> float:
        self.critics.train()
        values = self.critics(seen, actions)
        kept = (torch.rand_like(values) < 0.7).float()
        loss = ((values - returns).square() * kept).mean()
        self._critic_optimizer.zero_grad()
        loss.backward()
        self._critic_optimizer.step()
        self._approach(self.critics, self._target_critics)
        return float(loss.detach())

    def _learn_actor(self, seen: torch.Tensor) -> float:
        self.critics.eval()
        actions = self._learning_actor(seen)
        values = self.critics(seen, actions)
        worth = values.mean(dim=0) - self.settings.doubt * values.std(dim=0)
        loss = (self.settings.action_cost * actions.square().sum(dim=-1) - worth).mean()
        self._actor_optimizer.zero_grad()
        loss.backward()
        self._actor_optimizer.step()
        self._approach(self._learning_actor, self.actor.mlp)
        return float(loss.detach())

    def _approach(self, learning: nn.Module, average: nn.Module) -> None:
        """Let an average follow the weights that learn."""
        with torch.no_grad():
            for own, followed in zip(average.parameters(), learning.parameters(), strict=True):
                own.lerp_(followed, self.settings.average_rate)
