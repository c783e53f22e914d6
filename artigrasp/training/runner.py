"""PPO training: rsl-rl's learner in a loop that can be stopped and resumed at any iteration."""

import contextlib
import io
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from rsl_rl.algorithms import PPO
from torch.utils.tensorboard import SummaryWriter

from artigrasp.config import PPOConfig
from artigrasp.controllers.network import OBSERVATION_SETS, actor_settings, critic_settings
from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.errors import UserError
from artigrasp.training.vec_env import HandVecEnv

logger = logging.getLogger(__name__)

LATEST = "latest.pt"
"""Name of the newest checkpoint in a run folder."""


@dataclass(frozen=True)
class IterationReport:
    """What one PPO iteration measured."""

    iteration: int
    control_steps: int
    """Control steps so far, over all worlds."""
    wall_time: float
    """Training time so far [s]."""
    collect_time: float
    learn_time: float
    metrics: dict[str, float]
    """Means over the episodes that ended in this iteration, and the learner's losses."""


class Runner:
    """Trains one policy and keeps its run folder: checkpoints and TensorBoard events.

    Attributes:
        iteration: Iterations done.
        reports: Reports of this process's iterations.
    """

    def __init__(self, env: HandVecEnv, folder: Path, seed: int) -> None:
        """Build the learner.

        Args:
            env: The environment with its task.
            folder: Run folder, made if missing.
            seed: Seed of the network's initial weights and of the exploration noise.
        """
        self.env, self.folder, self.seed = env, folder, seed
        self.task = env.task
        torch.manual_seed(seed)
        with contextlib.redirect_stdout(io.StringIO()):  # rsl-rl prints its networks
            self.learner = PPO.construct_algorithm(env.get_observations(), env, _settings(self.task.ppo, env), "cpu")
        self.iteration = 0
        self.control_steps = 0
        self.wall_time = 0.0
        self.reports: list[IterationReport] = []

    def learn(self, iterations: int, on_iteration: Callable[[IterationReport], None] = lambda report: None) -> None:
        """Run PPO until ``iterations`` iterations are done in total, saving checkpoints on the way and at the end.

        Args:
            iterations: Total number of iterations, those before a resume included.
            on_iteration: Called after each one, for progress.
        """
        writer = SummaryWriter(log_dir=str(self.folder), flush_secs=10)
        self.learner.train_mode()
        try:
            while self.iteration < iterations:
                report = self._iterate()
                self.reports.append(report)
                for name, value in report.metrics.items():
                    writer.add_scalar(name, value, report.control_steps, walltime=None)
                on_iteration(report)
                if self.iteration % self.task.ppo.save_interval == 0 or self.iteration == iterations:
                    self.save()
        finally:
            writer.close()

    def save(self) -> Path:
        """Write the checkpoint of the present iteration, replacing the newest one."""
        learner: dict[str, Any] = {
            "critic": self.learner.critic.state_dict(),
            "optimizer": self.learner.optimizer.state_dict(),
            "torch_random": torch.get_rng_state(),
            "episode": torch.from_numpy(self.env.environment.episode.numpy()),
        }
        policy = PolicyFile(
            task=self.task,
            hand=self.env.environment.hand_name,
            objects=self.env.environment.object_names,
            seed=self.seed,
            iteration=self.iteration,
            control_steps=self.control_steps,
            wall_time=self.wall_time,
            actor=self.learner.actor.state_dict(),
            learner=learner,
        )
        path = self.folder / LATEST
        save_policy(policy, path)
        save_policy(replace(policy, learner=None), self.folder / "policy.pt")
        return path

    def resume(self, path: Path) -> None:
        """Continue from a checkpoint.

        Raises:
            UserError: The checkpoint belongs to another task or other objects, or cannot be resumed from.
        """
        policy = load_policy(path, task=self.task.name)
        if policy.learner is None:
            raise UserError(f"{path}: expected a checkpoint with the learner's state, found a policy for inference")
        if policy.objects != self.env.environment.object_names:
            expected, found = ", ".join(self.env.environment.object_names), ", ".join(policy.objects)
            raise UserError(f"{path}: objects: expected {expected}, found {found}")
        self.learner.actor.load_state_dict(policy.actor)
        self.learner.critic.load_state_dict(policy.learner["critic"])
        self.learner.optimizer.load_state_dict(policy.learner["optimizer"])
        self.learner.learning_rate = self.learner.optimizer.param_groups[0]["lr"]
        torch.set_rng_state(policy.learner["torch_random"])
        self.env.environment.episode.assign(policy.learner["episode"].numpy())
        self.env.restart()
        self.iteration, self.control_steps, self.wall_time = policy.iteration, policy.control_steps, policy.wall_time

    def _iterate(self) -> IterationReport:
        start = time.perf_counter()
        observations = self.env.get_observations()
        with torch.inference_mode():
            for _ in range(self.task.ppo.steps_per_env):
                actions = self.learner.act(observations)
                observations, rewards, dones, extras = self.env.step(actions)
                self.learner.process_env_step(observations, rewards, dones, extras)
            self.learner.compute_returns(observations)
        collected = time.perf_counter()
        losses = self.learner.update()
        learned = time.perf_counter()
        self.iteration += 1
        self.control_steps += (
            self.task.ppo.steps_per_env * self.env.decision_interval * self.env.environment.world_count
        )
        self.wall_time += learned - start
        metrics = {f"Loss/{name}": value for name, value in losses.items()}
        metrics["Policy/std"] = float(self.learner.get_policy().output_std.mean().detach())
        metrics["Policy/learning_rate"] = self.learner.learning_rate
        metrics |= self.env.pop_episode_means()
        metrics["Time/collect"], metrics["Time/learn"] = collected - start, learned - collected
        return IterationReport(
            self.iteration, self.control_steps, self.wall_time, collected - start, learned - collected, metrics
        )


def _settings(ppo: PPOConfig, env: HandVecEnv) -> dict[str, Any]:
    """rsl-rl's settings of a learner."""
    return {
        "num_steps_per_env": ppo.steps_per_env,
        "obs_groups": {name: list(groups) for name, groups in OBSERVATION_SETS.items()},
        "actor": actor_settings(ppo),
        "critic": critic_settings(ppo),
        "multi_gpu": None,
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": ppo.epochs,
            "num_mini_batches": ppo.mini_batches,
            "clip_param": ppo.clip,
            # one PPO step stands for several control steps
            "gamma": ppo.gamma**env.decision_interval,
            "lam": ppo.gae_lambda,
            "value_loss_coef": ppo.value_coefficient,
            "entropy_coef": ppo.entropy_coefficient,
            "learning_rate": ppo.learning_rate,
            "max_grad_norm": ppo.max_grad_norm,
            "schedule": ppo.schedule,
            "desired_kl": ppo.desired_kl,
        },
    }
