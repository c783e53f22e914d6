"""The environment as rsl-rl's vectorised environment: one row per world and hand."""

from typing import Any

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from artigrasp.arrays import Array
from artigrasp.controllers.network import OBSERVATION_GROUP
from artigrasp.environment.environment import Environment
from artigrasp.environment.measuring import LIFTED_HEIGHT
from artigrasp.environment.snapshot import restore_snapshot, take_snapshot
from artigrasp.errors import UserError

_OF_HINGE = ("success", "angle_error", "mean_angle_error", "least_angle_error")
"""What an episode says about articulation, and only about that."""

FAILURE_MEMORY = 0.2
"""Weight of the newest episode in the average of how often a reference fails."""
LEAST_WEIGHT = 0.02
"""What a reference that never fails counts when those that fail are practised."""


class HandVecEnv(VecEnv):
    """Every hand of every world is a row; one PPO step is ``decision_interval`` control steps.

    Everything stays on the environment's device, in memory that PyTorch and Warp share.

    The rewards within a PPO step are discounted by the powers of gamma, so that the return is the same as with one
    control step per PPO step. A world whose physics failed is reset at once and marked as done; what it earned in its
    last step is replaced by what the critic expected of it, so that failing is neither good nor bad.

    Attributes:
        environment: The batched environment.
        decision_interval: Control steps per PPO step.
    """

    def __init__(self, environment: Environment) -> None:
        """Wrap an environment and begin its first episodes.

        Raises:
            UserError: The environment is on a GPU, and PyTorch cannot use it.
        """
        if torch.device(environment.device).type == "cuda" and not torch.cuda.is_available():
            raise UserError(f"device: expected a PyTorch with CUDA to learn on {environment.device}, found one without")
        self.environment = environment
        self.task = self.cfg = environment.task
        self.decision_interval = self.task.action.decision_interval
        self.rows = environment.world_count * environment.hand_count
        self.num_envs, self.num_actions = self.rows, environment.action_count
        self.max_episode_length = self.task.episode_steps // self.decision_interval
        self.device = environment.device
        self._action = wp.zeros(
            (environment.world_count, environment.hand_count, self.num_actions), dtype=float, device=self.device
        )
        self._action_rows = self._as_rows(self._action)
        self._reward_rows = wp.to_torch(environment.reward).reshape(self.rows)
        self._terms = [(names, wp.to_torch(values)) for names, values in environment.reward_terms]
        self._feature_rows = self._as_rows(environment.features)
        self._active = wp.to_torch(environment.goal.active).reshape(self.rows)
        self._failure = wp.to_torch(environment.metrics.failure)
        self._returns: dict[str, list[float]] = {}
        self._articulates = np.concatenate([each.kind == "articulate" for each in environment.references])
        self._reported_failures = environment.failure_counts()
        self._failure_rate = np.ones(len(self._articulates), dtype=np.float32)
        self.restart()

    def restart(self) -> None:
        """Begin new episodes everywhere."""
        self.environment.reset()
        self.episode_length_buf = torch.zeros(self.rows, dtype=torch.long, device=self.device)
        self._term_sums = [torch.zeros_like(values) for _, values in self._terms]

    def get_observations(self) -> TensorDict:
        """Features of every row, in the one observation group."""
        self.environment.observe()
        # a copy: the environment overwrites its features while the learner still holds these
        features = self._feature_rows.clone()
        return TensorDict({OBSERVATION_GROUP: features}, batch_size=self.rows, device=self.device)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, torch.Tensor]]:
        """Hold an action for ``decision_interval`` control steps.

        Args:
            actions: [row, action] the policy's output.

        Returns:
            Observations after it, discounted rewards [row], dones [row] and, by name, ``time_outs``: 1 where an episode
            stopped without being over, so that the learner adds the value that the critic expected (an episode whose
            outcome is rewarded is over at its end), and ``active``: 1 where the hand took part.
        """
        self._action_rows.copy_(actions)
        active = self._active.float()  # before another episode begins
        rewards = torch.zeros(self.rows, device=self.device)
        for control_step in range(self.decision_interval):
            self.environment.step(self._action)
            rewards += self.task.ppo.gamma**control_step * self._reward_rows
            for sums, (_, values) in zip(self._term_sums, self._terms, strict=True):
                sums += values
        self.episode_length_buf += 1
        failed = (self._failure != 0).repeat_interleave(self.environment.hand_count)
        rewards.masked_fill_(failed, 0.0)
        ended = self.episode_length_buf >= self.max_episode_length
        dones = ended | failed
        if bool(dones.any()):
            self._end_episodes(dones)
        time_outs = failed if self.task.reward.rewards_outcome else dones
        return self.get_observations(), rewards, dones.long(), {"time_outs": time_outs.float(), "active": active}

    def pop_episode_totals(self) -> dict[str, tuple[float, int]]:
        """Sums over the episodes that ended since the last call, and how many they are of.

        These are what `episode_summary` holds, success and errors of the hinge over articulations only, the share of
        grasps of free objects that are in the air at the end and, of the episodes that did not fail, the sums of the
        rewards and of their terms.
        """
        totals = {name: (sum(values), len(values)) for name, values in self._returns.items()}
        self._returns.clear()
        return totals

    def pop_failures(self) -> dict[str, int]:
        """Episodes since the last call in which each kind of failed physics happened, all kinds included."""
        counts = self.environment.failure_counts()
        new = {f"Physics/{name}": count - self._reported_failures[name] for name, count in counts.items()}
        self._reported_failures = counts
        return new

    def state_dict(self) -> dict[str, Any]:
        """What :meth:`load_state_dict` needs: little between episodes, all worlds in the middle of some."""
        state: dict[str, Any] = {"episode": torch.from_numpy(self.environment.episode.numpy().copy())}
        if self.task.practice:
            state["failure_rate"] = torch.from_numpy(self._failure_rate.copy())
        if bool(self.episode_length_buf.any()):
            worlds = take_snapshot(self.environment)
            state["worlds"] = {name: torch.from_numpy(values) for name, values in worlds.items()}
            state["episode_lengths"] = self.episode_length_buf.clone()
            state["term_sums"] = [sums.clone() for sums in self._term_sums]
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another of its kind was.

        Raises:
            KeyError, RuntimeError, ValueError: That one was of other worlds.
        """
        if self.task.practice:
            self._failure_rate[:] = state["failure_rate"].numpy()
            self._weigh_references()
        if "worlds" not in state:
            # the reset counts one more
            self.environment.episode.assign(state["episode"].numpy() - 1)
            self.restart()
            return
        restore_snapshot(self.environment, {name: values.numpy() for name, values in state["worlds"].items()})
        self.episode_length_buf.copy_(state["episode_lengths"])
        for sums, values in zip(self._term_sums, state["term_sums"], strict=True):
            sums.copy_(values)
        self._reported_failures = self.environment.failure_counts()

    def _end_episodes(self, dones: torch.Tensor) -> None:
        worlds = dones.reshape(self.environment.world_count, -1).any(dim=1)
        summary = self.environment.episode_summary()
        ended = worlds.cpu().numpy()
        reference = self.environment.reference_index.numpy()
        articulates = self._articulates[reference]
        if not self.task.fixed_base:
            summary["lifted"] = ((summary["lift"] > LIFTED_HEIGHT) & (summary["failed"] == 0.0)).astype(np.float64)
        for name, values in summary.items():
            shown_by = articulates if name in _OF_HINGE else ~articulates if name == "lifted" else True
            self._returns.setdefault(f"Episode/{name}", []).extend(values[ended & shown_by].tolist())
        sound = self._failure == 0
        total = torch.stack([sums[worlds & sound].sum(dim=2) for sums in self._term_sums]).sum(dim=0)
        self._returns.setdefault("Episode/reward", []).extend(total.flatten().tolist())
        if self.task.practice:
            reached = np.where(articulates, summary["success"], summary.get("lifted", 0.0))
            self._note_outcomes(reference[ended], reached[ended])
        for sums, (names, _) in zip(self._term_sums, self._terms, strict=True):
            for name, values in zip(names, sums[worlds & sound].mean(dim=1).T, strict=True):
                self._returns.setdefault(f"Reward/{name}", []).extend(values.tolist())
            sums[worlds] = 0.0
        self.episode_length_buf[dones] = 0
        self.environment.reset(wp.from_torch(worlds.int()))

    def _note_outcomes(self, reference: NDArray[np.integer], reached: Array) -> None:
        """Let references that fail be practised more often, by the running averages of how often they do."""
        for index in np.unique(reference):
            tries = reference == index
            kept = (1.0 - FAILURE_MEMORY) ** tries.sum()
            self._failure_rate[index] *= kept
            self._failure_rate[index] += (1.0 - kept) * (1.0 - reached[tries].mean())
        self._weigh_references()

    def _weigh_references(self) -> None:
        self.environment.reference_weight.assign(np.maximum(self._failure_rate, LEAST_WEIGHT))

    def _as_rows(self, array: wp.array) -> torch.Tensor:
        rows: torch.Tensor = wp.to_torch(array).reshape(self.rows, -1)
        return rows
