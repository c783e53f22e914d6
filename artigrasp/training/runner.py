"""PPO training: rsl-rl's learners in a loop that can be stopped at any time and resumed from its newest checkpoint."""

import contextlib
import copy
import logging
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch.utils.tensorboard import SummaryWriter

from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.errors import UserError
from artigrasp.training.evaluation import EvaluationPoint, PeriodicEvaluation, read_evaluations, write_evaluations
from artigrasp.training.learners import Learners
from artigrasp.training.learning_curve import CurvePoint, read_curve, write_curve
from artigrasp.training.processes import ALONE, Processes, mean_of
from artigrasp.training.vec_env import HandVecEnv

logger = logging.getLogger(__name__)

CHECKPOINT, POLICY, BEST_POLICY = "latest.pt", "policy.pt", "best.pt"
"""Files of a run folder: the newest checkpoint, to resume from; what acts of it; what acted best when evaluated."""

SAVE_SECONDS = 300.0
"""Age of the checkpoint from which another is written after the next iteration, however many those were [s]."""


class TrainingFailedError(Exception):
    """The learner's numbers are none any more; the checkpoint is that of the last iteration in which they were."""


@dataclass(frozen=True)
class IterationReport:
    """What one PPO iteration measured."""

    iteration: int
    control_steps: int
    """Control steps so far, over all worlds and processes."""
    wall_time: float
    """Training time so far [s]."""
    collect_time: float
    learn_time: float
    metrics: dict[str, float]
    """Means over the episodes that ended in this iteration, counts of failed physics, losses, times and speed."""


class Runner:
    """Trains a policy and keeps its run folder: checkpoint, policies, learning curve and TensorBoard events.

    Attributes:
        iteration: Iterations done.
        control_steps: Control steps simulated so far, over all worlds and processes.
        wall_time: Training time so far [s]; evaluations do not count.
        cpu_time: Processor time of that, over all threads and processes [s].
        curve: The learning curve: a point for every iteration in which episodes ended.
        evaluations: What was measured between iterations.
    """

    def __init__(
        self,
        env: HandVecEnv,
        folder: Path,
        seed: int,
        thread_count: int = 1,
        *,
        evaluation: PeriodicEvaluation | None = None,
        processes: Processes = ALONE,
    ) -> None:
        """Build the learners.

        Args:
            env: The environment with its task.
            folder: Run folder, made when the first file goes there.
            seed: Seed of the networks' initial weights and of the exploration noise.
            thread_count: Threads that learn. More than one should not spin while they wait for each other
                (``OMP_WAIT_POLICY=passive`` before PyTorch is imported): where anything else wants a core, that makes
                them many times slower than one.
            evaluation: What to measure between iterations, if anything.
            processes: Those that train together; the first one keeps the folder.
        """
        self.env, self.folder, self.seed, self.thread_count = env, folder, seed, thread_count
        self.task, self.processes, self._evaluation = env.task, processes, evaluation
        torch.set_num_threads(1)  # while the physics steps; a second pool of threads would only disturb it
        torch.manual_seed(seed)
        self.learners = Learners(self.task, env.get_observations(), env.num_actions, processes)
        if not processes.is_first:
            torch.manual_seed(processes.own_seed(seed))
        self.iteration = 0
        self.control_steps = 0
        self.wall_time = 0.0
        self.cpu_time = 0.0
        self.curve: list[CurvePoint] = []
        self.evaluations: list[EvaluationPoint] = []
        self._unsaved: PolicyFile | None = None

    def learn(self, iterations: int, on_iteration: Callable[[IterationReport], None] = lambda report: None) -> None:
        """Run PPO until ``iterations`` iterations are done in total, saving checkpoints on the way and at the end.

        However it ends, nothing is lost but the iteration under way; with several processes, those since the last
        checkpoint.

        Args:
            iterations: Total number of iterations, those before a resume included.
            on_iteration: Called after each one, for progress.

        Raises:
            TrainingFailedError: A weight is no number any more.
        """
        writer = None
        if self.processes.is_first:
            # events of iterations after the checkpoint, which are now done again, go
            writer = SummaryWriter(log_dir=str(self.folder), flush_secs=10, purge_step=self.control_steps + 1)
        self.learners.train_mode()
        saved = time.monotonic()
        try:
            if self.iteration >= iterations and not (self.folder / CHECKPOINT).is_file():
                self._unsaved = self._snapshot()
            while self.iteration < iterations:
                report = self.iterate()
                if self.processes.count == 1:
                    self._unsaved = self._snapshot()
                if writer is not None:
                    for name, value in report.metrics.items():
                        writer.add_scalar(name, value, report.control_steps)
                is_last = self.iteration == iterations
                interval = self.task.ppo.evaluation_interval
                if self._evaluation is not None and (self.iteration % interval == 0 or is_last):
                    self._evaluate(self._evaluation, writer)
                on_iteration(report)
                is_due = self.iteration % self.task.ppo.save_interval == 0 or time.monotonic() - saved > SAVE_SECONDS
                if is_last or self.processes.gather(is_due)[0]:
                    self.save()
                    saved = time.monotonic()
        finally:
            if self._unsaved is not None:
                self._write(self._unsaved)
            if writer is not None:
                writer.close()

    def iterate(self) -> IterationReport:
        """Collect with the present policy, then learn from it; writes nothing.

        Raises:
            TrainingFailedError: A weight is no number any more.
        """
        start, cpu_start = time.perf_counter(), time.process_time()
        observations = self.env.get_observations()
        with torch.inference_mode():
            for _ in range(self.task.ppo.steps_per_env):
                actions = self.learners.act(observations)
                observations, rewards, dones, extras = self.env.step(actions)
                self.learners.record(rewards, dones, extras)
            self.learners.compute_returns(observations)
        collected = time.perf_counter()
        with _torch_threads(self.thread_count):
            learned_metrics = self.learners.update()
        learned = time.perf_counter()
        if not self.learners.is_finite() or not all(map(math.isfinite, learned_metrics.values())):
            raise TrainingFailedError(
                f"iteration {self.iteration + 1}: expected finite weights and losses, found others: resume from "
                f"iteration {self.iteration} with a lower learning rate"
            )
        cpu_time = time.process_time() - cpu_start

        metrics: dict[str, float] = {}
        gathered = self.processes.gather((cpu_time, self.env.pop_episode_totals(), self.env.pop_failures()))
        cpu_times, totals, failures = zip(*gathered, strict=True)
        metrics |= mean_of(list(totals))
        metrics |= {name: sum(each[name] for each in failures) for name in failures[0]}
        metrics |= learned_metrics
        new_steps = self.task.ppo.steps_per_env * self.env.decision_interval * self.env.environment.world_count
        new_steps *= self.processes.count
        self.iteration += 1
        self.control_steps += new_steps
        self.wall_time += learned - start
        self.cpu_time += sum(cpu_times)
        metrics["Time/collect"], metrics["Time/learn"] = collected - start, learned - collected
        metrics["Time/wall"], metrics["Time/cpu"] = self.wall_time, self.cpu_time
        metrics["Time/control_steps_per_s"] = new_steps / (learned - start)
        if "Episode/reward" in metrics:
            shown = {name: metrics.get(f"Episode/{name}", math.nan) for name in _CURVE}
            self.curve.append(CurvePoint(self.iteration, self.control_steps, self.wall_time, self.cpu_time, **shown))
        return IterationReport(
            self.iteration, self.control_steps, self.wall_time, collected - start, learned - collected, metrics
        )

    def save(self) -> None:
        """Write checkpoint, policy and learning curve of the present iteration over those before."""
        self._write(self._snapshot())

    def start_from(self, path: Path) -> None:
        """Begin with the networks of a policy file or checkpoint, as far as it has those of this task.

        Raises:
            UserError: It has none of them, or networks of another shape.
        """
        policy = load_policy(path)
        if not set(policy.actors) & set(self.task.networks):
            expected, found = ", ".join(self.task.networks), ", ".join(policy.actors)
            raise UserError(f"{path}: networks: expected some of {expected}, found {found}")
        try:
            self.learners.start_from(policy.actors, None if policy.learner is None else policy.learner["learners"])
        except Exception as error:  # Another's state can fail in any way of PyTorch's optimizers and modules.
            raise UserError(f"{path}: expected networks of this task's shape, found others: {error}") from error

    def resume(self) -> None:
        """Continue from the folder's checkpoint: what follows is what would have followed without the interruption.

        Raises:
            UserError: There is no checkpoint, or it belongs to another task or other objects, hands, worlds or
                processes.
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
            states = policy.learner["processes"]
            if len(states) != self.processes.count:
                raise UserError(f"{path}: processes: expected {self.processes.count}, found {len(states)}")
            own = states[self.processes.rank]
            self.learners.load(policy.actors, policy.learner["learners"])
            _random_generator(environment.device).set_state(own["torch_random"])
            self.env.load_state_dict(own["environment"])
            self.cpu_time = float(policy.learner["cpu_time"])
        except UserError:
            raise
        except Exception as error:  # Another's state can fail in any way of PyTorch's optimizers and modules.
            detail = f"no {error}" if isinstance(error, KeyError) else error
            raise UserError(
                f"{path}: expected the state of this run's learner, found another, perhaps an older version's: "
                f"{detail}; --start-from begins a new run with its networks"
            ) from error
        self.iteration, self.control_steps, self.wall_time = policy.iteration, policy.control_steps, policy.wall_time
        self.curve = [point for point in read_curve(self.folder) if point.iteration <= self.iteration]
        self.evaluations = [point for point in read_evaluations(self.folder) if point.iteration <= self.iteration]

    def _snapshot(self) -> PolicyFile:
        """Everything that a checkpoint holds, as it is now; all processes must ask at the same time."""
        environment = self.env.environment
        state = {
            "torch_random": _random_generator(environment.device).get_state(),
            "environment": self.env.state_dict(),
        }
        learner = {
            "learners": copy.deepcopy(self.learners.state_dict()),
            "processes": self.processes.gather(state),
            "cpu_time": self.cpu_time,
        }
        return replace(self._policy(), learner=learner)

    def _policy(self) -> PolicyFile:
        environment = self.env.environment
        return PolicyFile(
            task=replace(self.task, world_count=self.task.world_count * self.processes.count),
            hand=environment.hand_name,
            objects=environment.object_names,
            seed=self.seed,
            iteration=self.iteration,
            control_steps=self.control_steps,
            wall_time=self.wall_time,
            actors=copy.deepcopy(self.learners.actors()),
        )

    def _write(self, checkpoint: PolicyFile) -> None:
        if not self.processes.is_first:
            return
        points = [point for point in self.curve if point.iteration <= checkpoint.iteration]
        write_curve(self.folder, points, f"{self.task.name} on {', '.join(checkpoint.objects)}")
        save_policy(replace(checkpoint, learner=None), self.folder / POLICY)
        # last: what the others are ahead of it is done again, but what they lacked nobody would write
        save_policy(checkpoint, self.folder / CHECKPOINT)
        self._unsaved = None

    def _evaluate(self, evaluation: PeriodicEvaluation, writer: SummaryWriter | None) -> None:
        """Measure the policy, and keep it if none before was better; the first process does, the others wait."""
        policy = self._policy()
        results = evaluation.measure(policy) if writer is not None else {}
        if writer is not None and results:
            point = EvaluationPoint(self.iteration, self.control_steps, self.wall_time, self.cpu_time, **results)
            for name, value in results.items():
                if math.isfinite(value):
                    writer.add_scalar(f"Evaluation/{name}", value, self.control_steps)
            if all(point.score >= other.score for other in self.evaluations):
                save_policy(policy, self.folder / BEST_POLICY)
            self.evaluations.append(point)
            write_evaluations(self.folder, self.evaluations)
        self.processes.gather(None)


_CURVE = ("reward", "success", "angle_error", "lifted")
"""What of an iteration's metrics is in the learning curve."""


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
