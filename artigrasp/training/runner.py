"""PPO training: rsl-rl's learner in a loop that can be stopped at any time and resumed from its newest checkpoint."""

import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from torch.utils.tensorboard import SummaryWriter

from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.errors import UserError
from artigrasp.training.learners import Learners
from artigrasp.training.run_folder import CurvePoint, read_curve, write_curve
from artigrasp.training.vec_env import HandVecEnv

logger = logging.getLogger(__name__)

CHECKPOINT, POLICY = "latest.pt", "policy.pt"
"""Files of a run folder: the newest checkpoint, to resume from, and what acts of it."""


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
    """Means over the episodes that ended in this iteration, counts of failed physics, and the learner's losses."""


class Runner:
    """Trains a policy and keeps its run folder: checkpoint, policy, learning curve and TensorBoard events.

    Attributes:
        iteration: Iterations done.
        control_steps: Control steps simulated so far, over all worlds.
        wall_time: Training time so far [s].
        curve: The learning curve: a point for every iteration in which episodes ended.
    """

    def __init__(self, env: HandVecEnv, folder: Path, seed: int, thread_count: int = 1) -> None:
        """Build the learners.

        Args:
            env: The environment with its task.
            folder: Run folder, made when the first file goes there.
            seed: Seed of the network's initial weights and of the exploration noise.
            thread_count: Threads that learn. More than one should not spin while they wait for each other
                (``OMP_WAIT_POLICY=passive`` before PyTorch is imported): where anything else wants a core, that makes
                them many times slower than one.
        """
        self.env, self.folder, self.seed, self.thread_count = env, folder, seed, thread_count
        self.task = env.task
        torch.set_num_threads(1)  # while the physics steps; a second pool of threads would only disturb it
        torch.manual_seed(seed)
        self.learners = Learners(self.task, env.get_observations(), env.num_actions)
        self.iteration = 0
        self.control_steps = 0
        self.wall_time = 0.0
        self.curve: list[CurvePoint] = []

    def learn(self, iterations: int, on_iteration: Callable[[IterationReport], None] = lambda report: None) -> None:
        """Run PPO until ``iterations`` iterations are done in total, saving checkpoints on the way and at the end.

        Args:
            iterations: Total number of iterations, those before a resume included.
            on_iteration: Called after each one, for progress.
        """
        writer = SummaryWriter(log_dir=str(self.folder), flush_secs=10)
        self.learners.train_mode()
        try:
            while self.iteration < iterations:
                report = self.iterate()
                for name, value in report.metrics.items():
                    writer.add_scalar(name, value, report.control_steps)
                on_iteration(report)
                if self.iteration % self.task.ppo.save_interval == 0 or self.iteration == iterations:
                    self.save()
        finally:
            writer.close()

    def iterate(self) -> IterationReport:
        """Collect with the present policy, then learn from it; writes nothing."""
        start = time.perf_counter()
        observations = self.env.get_observations()
        with torch.inference_mode():
            for _ in range(self.task.ppo.steps_per_env):
                actions = self.learners.act(observations)
                observations, rewards, dones, extras = self.env.step(actions)
                self.learners.record(rewards, dones, extras)
            self.learners.compute_returns(observations)
        collected = time.perf_counter()
        with _torch_threads(self.thread_count):
            metrics: dict[str, float] = self.learners.update()
        learned = time.perf_counter()
        self.iteration += 1
        self.control_steps += (
            self.task.ppo.steps_per_env * self.env.decision_interval * self.env.environment.world_count
        )
        self.wall_time += learned - start
        metrics |= self.env.pop_episode_means()
        metrics |= self.env.pop_failures()
        metrics["Time/collect"], metrics["Time/learn"] = collected - start, learned - collected
        if "Episode/success" in metrics:
            success, error = metrics["Episode/success"], metrics["Episode/angle_error"]
            self.curve.append(CurvePoint(self.iteration, self.control_steps, self.wall_time, success, error))
        return IterationReport(
            self.iteration, self.control_steps, self.wall_time, collected - start, learned - collected, metrics
        )

    def save(self) -> None:
        """Write checkpoint, policy and learning curve of the present iteration over those before."""
        environment = self.env.environment
        policy = PolicyFile(
            task=self.task,
            hand=environment.hand_name,
            objects=environment.object_names,
            seed=self.seed,
            iteration=self.iteration,
            control_steps=self.control_steps,
            wall_time=self.wall_time,
            actors=self.learners.actors(),
        )
        learner: dict[str, Any] = {
            "learners": self.learners.state_dict(),
            "torch_random": _random_generator(environment.device).get_state(),
            "episode": torch.from_numpy(environment.episode.numpy()),
        }
        save_policy(replace(policy, learner=learner), self.folder / CHECKPOINT)
        save_policy(policy, self.folder / POLICY)
        write_curve(self.folder, self.curve, f"{self.task.name} on {', '.join(environment.object_names)}")

    def resume(self) -> None:
        """Continue from the folder's checkpoint.

        The episodes that were under way begin again. Where iterations end together with episodes, what follows is
        exactly what would have followed without the interruption.

        Raises:
            UserError: There is no checkpoint, or it belongs to another task or other objects, hands or worlds.
        """
        path, environment = self.folder / CHECKPOINT, self.env.environment
        policy = load_policy(path, task=self.task.name)
        if policy.learner is None:
            raise UserError(f"{path}: expected a checkpoint with the learner's state, found a policy for inference")
        for name, expected, found in (
            ("objects", ", ".join(environment.object_names), ", ".join(policy.objects)),
            ("hand", environment.hand_name, policy.hand),
        ):
            if found != expected:
                raise UserError(f"{path}: {name}: expected {expected}, found {found}")
        try:
            self.learners.load(policy.actors, policy.learner["learners"])
            _random_generator(environment.device).set_state(policy.learner["torch_random"])
            environment.episode.assign(policy.learner["episode"].numpy() - 1)
        except (AttributeError, KeyError, RuntimeError, TypeError, ValueError) as error:
            detail = str(error).splitlines()[0]
            raise UserError(f"{path}: expected the state of this run's learner, found another: {detail}") from error
        self.env.restart()
        self.iteration, self.control_steps, self.wall_time = policy.iteration, policy.control_steps, policy.wall_time
        self.curve = [point for point in read_curve(self.folder) if point.iteration <= self.iteration]


def _random_generator(device: str) -> torch.Generator:
    """What exploration on a device draws from."""
    if torch.device(device).type == "cpu":
        return torch.default_generator
    return torch.cuda.default_generators[torch.device(device).index or 0]


@contextlib.contextmanager
def _torch_threads(count: int) -> Iterator[None]:
    """Let PyTorch use so many threads for a while."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
