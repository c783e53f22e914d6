"""Who learns for the hands of a scene: a learner for each hand, or one that learns from both and mirrors the left."""

import contextlib
import io
from dataclasses import dataclass
from typing import Any, cast

import torch
from rsl_rl.algorithms import PPO
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from artigrasp.config import TaskConfig
from artigrasp.config.task import MIRRORED
from artigrasp.controllers.mirror import mirror_actions, mirror_features
from artigrasp.controllers.network import (
    OBSERVATION_GROUP,
    OBSERVATION_SETS,
    actor_settings,
    critic_settings,
    observed_columns,
)
from artigrasp.errors import UserError
from artigrasp.training.processes import ALONE, Processes
from artigrasp.training.replay import Replay


@dataclass(frozen=True)
class _Rows:
    """What rsl-rl asks of an environment when it builds a learner."""

    num_envs: int
    num_actions: int


class HandLearner:
    """A learner with a row for each of its hands in every world.

    Attributes:
        name: Name of its network, one of the task's.
        columns: Its hands' indices in the scene.
        algorithm: rsl-rl's PPO, or what learns from replay in its place.
    """

    def __init__(
        self, name: str, task: TaskConfig, features: torch.Tensor, action_count: int, processes: Processes
    ) -> None:
        """Build the networks, which draws from PyTorch's random generator.

        Args:
            name: One of the task's networks.
            task: What is learned.
            features: [world, hand, feature] for their size and device.
            action_count: Length of one hand's action.
            processes: Those that learn together.

        Raises:
            UserError: Several processes are to learn from replay.
        """
        self.name, self._action, self._processes = name, task.action, processes
        self._observed = observed_columns(task.ppo)
        self.columns = [column for column, side in enumerate(task.hands) if name in (side, MIRRORED)]
        self._mirrored = [i for i, hand in enumerate(self.columns) if name == MIRRORED and task.hands[hand] == "left"]
        observations = self._observe(features[:, self.columns])
        self.algorithm: PPO | Replay
        if task.replay is not None:
            if processes.count > 1:
                raise UserError(f"processes: expected one, for {task.name} learns from replay, found {processes.count}")
            self.algorithm = Replay(task.replay, task.ppo, _discount(task), len(self._observed), action_count)
            return
        rows = cast(VecEnv, _Rows(len(observations), action_count))
        with contextlib.redirect_stdout(io.StringIO()):  # rsl-rl prints its networks
            settings = _settings(task, processes)
            self.algorithm = PPO.construct_algorithm(observations, rows, settings, str(features.device))
        if processes.count > 1:
            self.algorithm.broadcast_parameters()

    def act(self, features: torch.Tensor) -> torch.Tensor:
        """Sample actions [world, own hand, action] from the features [world, hand, feature] of all hands."""
        own = features[:, self.columns]
        actions: torch.Tensor = self.algorithm.act(self._observe(own)).reshape(*own.shape[:2], -1)
        if self._mirrored:
            # the learner keeps what it did itself; the environment gets the mirror image
            actions = actions.clone()
            mirrored = mirror_actions(actions[:, self._mirrored], own[:, self._mirrored], self._action)
            actions[:, self._mirrored] = mirrored
        return actions

    def record(self, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, torch.Tensor]) -> None:
        """Keep what the last actions led to; all are [world, hand] of all hands."""
        rewards, dones = (values[:, self.columns].flatten() for values in (rewards, dones))
        extras = {name: values[:, self.columns].flatten() for name, values in extras.items()}
        nothing = TensorDict({}, batch_size=len(rewards))  # rsl-rl looks at the next observations for RND alone
        self.algorithm.process_env_step(nothing, rewards, dones, extras)

    def compute_returns(self, features: torch.Tensor) -> None:
        """Close the collection with the features [world, hand, feature] that follow it."""
        self.algorithm.compute_returns(self._observe(features[:, self.columns]))
        if self._processes.count > 1 and isinstance(self.algorithm, PPO):
            storage = self.algorithm.storage
            storage.advantages = self._processes.normalize(storage.returns - storage.values)

    def update(self) -> dict[str, float]:
        """Learn; the losses and exploration, by name."""
        losses = {f"Loss/{name}": value for name, value in self.algorithm.update().items()}
        if isinstance(self.algorithm, PPO):
            losses["Policy/std"] = float(self.algorithm.get_policy().output_std.mean().detach())
            losses["Policy/learning_rate"] = self.algorithm.learning_rate
        return losses

    def state_dict(self) -> dict[str, Any]:
        """Critics and optimizers; the actor is the policy file's."""
        if isinstance(self.algorithm, Replay):
            return self.algorithm.state_dict()
        return {"critic": self.algorithm.critic.state_dict(), "optimizer": self.algorithm.optimizer.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take up :meth:`state_dict`.

        Raises:
            KeyError, RuntimeError, TypeError, ValueError: It is that of another learner.
        """
        if isinstance(self.algorithm, Replay):
            self.algorithm.load_state_dict(state)
            return
        self.algorithm.critic.load_state_dict(state["critic"])
        self.algorithm.optimizer.load_state_dict(state["optimizer"])
        self.algorithm.learning_rate = self.algorithm.optimizer.param_groups[0]["lr"]

    def start_from(self, actor: dict[str, torch.Tensor], state: dict[str, Any] | None) -> None:
        """Begin with the networks of another training; see :meth:`Learners.start_from`."""
        self.algorithm.actor.load_state_dict(actor)
        if isinstance(self.algorithm, Replay) and state is not None and "memory" in state:
            self.algorithm.load_state_dict(state)
        elif isinstance(self.algorithm, Replay):
            self.algorithm.learn_on_from_actor()
        if isinstance(self.algorithm, PPO) and state is not None and "critic" in state:
            self.algorithm.critic.load_state_dict(state["critic"])

    def is_finite(self) -> bool:
        """Whether every weight is a number."""
        critic = self.algorithm.critic if isinstance(self.algorithm, PPO) else self.algorithm.critics
        models = (self.algorithm.actor, critic)
        return all(bool(torch.isfinite(weights).all()) for model in models for weights in model.parameters())

    def _observe(self, own: torch.Tensor) -> TensorDict:
        """Features [world, own hand, feature] as the networks see them."""
        if self._mirrored:
            own = own.clone()
            own[:, self._mirrored] = mirror_features(own[:, self._mirrored])
        rows = own.flatten(0, 1)[:, self._observed]
        return TensorDict({OBSERVATION_GROUP: rows}, batch_size=len(rows), device=rows.device)


class Learners:
    """The learners of all hands; tensors have a row for every hand of every world, as :class:`HandVecEnv` has them."""

    def __init__(
        self, task: TaskConfig, observations: TensorDict, action_count: int, processes: Processes = ALONE
    ) -> None:
        """Build the learner of each of the task's networks."""
        self._hand_count = len(task.hands)
        features = self._by_hand(observations[OBSERVATION_GROUP])
        self.each = [HandLearner(name, task, features, action_count, processes) for name in task.networks]

    def train_mode(self) -> None:
        """Let networks learn, their normalisers included."""
        for learner in self.each:
            learner.algorithm.train_mode()

    def act(self, observations: TensorDict) -> torch.Tensor:
        """Sample actions [row, action]."""
        features = self._by_hand(observations[OBSERVATION_GROUP])
        actions = [learner.act(features) for learner in self.each]
        by_hand = actions[0].new_empty((*features.shape[:2], actions[0].shape[-1]))
        for learner, own in zip(self.each, actions, strict=True):
            by_hand[:, learner.columns] = own
        return by_hand.flatten(0, 1)

    def record(self, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, torch.Tensor]) -> None:
        """Keep what the last actions led to, all [row]."""
        by_hand = {name: self._by_hand(values) for name, values in extras.items()}
        for learner in self.each:
            learner.record(self._by_hand(rewards), self._by_hand(dones), by_hand)

    def compute_returns(self, observations: TensorDict) -> None:
        """Close the collection with the observations that follow it."""
        for learner in self.each:
            learner.compute_returns(self._by_hand(observations[OBSERVATION_GROUP]))

    def update(self) -> dict[str, float]:
        """Learn from what was collected; the losses, exploration and learning rate, by name."""
        metrics: dict[str, float] = {}
        for learner in self.each:
            suffix = f"_{learner.name}" if len(self.each) > 1 else ""
            metrics |= {f"{name}{suffix}": value for name, value in learner.update().items()}
        return metrics

    def actors(self) -> dict[str, dict[str, torch.Tensor]]:
        """States of the actor networks by their names."""
        return {learner.name: learner.algorithm.actor.state_dict() for learner in self.each}

    def state_dict(self) -> dict[str, Any]:
        """What else there is to each learner, by the name of its network."""
        return {learner.name: learner.state_dict() for learner in self.each}

    def load(self, actors: dict[str, dict[str, torch.Tensor]], state: dict[str, Any]) -> None:
        """Take up :meth:`actors` and :meth:`state_dict`.

        Raises:
            KeyError, RuntimeError, TypeError, ValueError: They are those of other learners.
        """
        for learner in self.each:
            learner.algorithm.actor.load_state_dict(actors[learner.name])
            learner.load_state_dict(state[learner.name])

    def start_from(self, actors: dict[str, dict[str, torch.Tensor]], state: dict[str, Any] | None) -> None:
        """Begin with the networks of another training, as far as it has them; PPO's optimizers begin anew.

        What another learner from replay has tried, and its critics, are taken along.

        Args:
            actors: States of its actors by the names of their networks.
            state: Its :meth:`state_dict`; without one, or one of the other kind, critics begin anew.

        Raises:
            KeyError, RuntimeError, TypeError: Its networks are of another shape.
        """
        for learner in self.each:
            if learner.name in actors:
                learner.start_from(actors[learner.name], None if state is None else state[learner.name])

    def is_finite(self) -> bool:
        """Whether every weight is a number."""
        return all(learner.is_finite() for learner in self.each)

    def _by_hand(self, rows: torch.Tensor) -> torch.Tensor:
        return rows.reshape(-1, self._hand_count, *rows.shape[1:])


def _discount(task: TaskConfig) -> float:
    """Discount per decision, which stands for several control steps."""
    return task.ppo.gamma**task.action.decision_interval


def _settings(task: TaskConfig, processes: Processes) -> dict[str, Any]:
    """rsl-rl's settings of a learner."""
    ppo = task.ppo
    return {
        "num_steps_per_env": ppo.steps_per_env,
        "obs_groups": {name: list(groups) for name, groups in OBSERVATION_SETS.items()},
        "actor": actor_settings(ppo),
        "critic": critic_settings(ppo),
        "multi_gpu": processes.rsl_rl_settings,
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": ppo.epochs,
            "num_mini_batches": ppo.mini_batches,
            "clip_param": ppo.clip,
            "gamma": _discount(task),
            "lam": ppo.gae_lambda,
            "value_loss_coef": ppo.value_coefficient,
            "entropy_coef": ppo.entropy_coefficient,
            "learning_rate": ppo.learning_rate,
            "max_grad_norm": ppo.max_grad_norm,
            "schedule": ppo.schedule,
            "desired_kl": ppo.desired_kl,
        },
    }
