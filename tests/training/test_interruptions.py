"""However a training ends, it can go on as if it had not."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from artigrasp.config import TaskConfig
from artigrasp.controllers.policy_file import load_policy
from artigrasp.training import learning_curve
from artigrasp.training import runner as runner_module
from artigrasp.training.learning_curve import read_curve
from artigrasp.training.runner import CHECKPOINT, POLICY, Runner, TrainingFailedError
from tests.training.examples import make_new_env, small_paper

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes longer than training here."""
    monkeypatch.setattr(learning_curve, "plot_curves", lambda target, runs, title: target.touch())


def staggered() -> TaskConfig:
    """The paper's task with episodes of six steps, iterations of four, and a checkpoint after every other one."""
    task = small_paper()
    return replace(task, ppo=replace(task.ppo, steps_per_env=4, save_interval=2))


def make_runner(folder: Path, task: TaskConfig | None = None) -> Runner:
    """A learner at its beginning, which shares nothing with another."""
    return Runner(make_new_env(task or staggered()), folder, seed=0)


def stop_at(runner: Runner, iteration: int, stop: object) -> None:
    """Call something in the middle of an iteration's collection."""
    step = runner.env.step

    def step_or_stop(actions: torch.Tensor) -> object:
        result = step(actions)
        if runner.iteration == iteration - 1 and runner.env.episode_length_buf.any():
            stop()
        return result

    runner.env.step = step_or_stop


def train_until_killed(folder: Path) -> None:
    """What the child process does: it is killed in its fourth iteration."""
    runner = make_runner(folder)
    stop_at(runner, 4, lambda: os.kill(os.getpid(), signal.SIGKILL))
    runner.learn(5)


def assert_same_training(found: Runner, expected: Runner) -> None:
    """Bit for bit, what was learned and how it went."""
    (first,), (second,) = found.learners.each, expected.learners.each
    for model in ("actor", "critic"):
        states = [getattr(each.algorithm, model).state_dict() for each in (first, second)]
        assert all(torch.equal(states[0][name], states[1][name]) for name in states[1])
    kept = [
        [(point.iteration, point.control_steps, point.reward) for point in each.curve] for each in (found, expected)
    ]
    assert kept[0] == kept[1]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Runner:
    """Five iterations at a stretch."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learning_curve, "plot_curves", lambda target, runs, title: target.touch())
        runner = make_runner(tmp_path_factory.mktemp("uninterrupted"))
        runner.learn(5)
    return runner


def test_a_killed_run_goes_on(uninterrupted: Runner, tmp_path: Path) -> None:
    """Its checkpoint is older than what was lost, in the middle of episodes; what follows is the same."""
    code = "import sys, pathlib; from tests.training.test_interruptions import train_until_killed as train; "
    code += "train(pathlib.Path(sys.argv[1]))"
    child = subprocess.run([sys.executable, "-c", code, tmp_path], cwd=ROOT, capture_output=True)
    assert child.returncode == -signal.SIGKILL, child.stderr.decode()
    assert load_policy(tmp_path / CHECKPOINT).iteration == 2
    runner = make_runner(tmp_path)
    runner.resume()
    assert runner.iteration == 2 and runner.env.episode_length_buf.any()
    runner.learn(5)
    assert_same_training(runner, uninterrupted)


@pytest.mark.parametrize("count", range(7, 9))
def test_a_run_killed_between_the_files_of_its_end_goes_on(uninterrupted: Runner, tmp_path: Path, count: int) -> None:
    """Three times three files are written, of which so many are there; none lacks anything in the end."""
    written: list[Any] = []

    def write_or_not(write: Callable[..., None]) -> Callable[..., None]:
        def unless_killed(*arguments: Any) -> None:
            if len(written) < count:
                written.append(arguments)
                write(*arguments)

        return unless_killed

    with pytest.MonkeyPatch.context() as patch:
        for name in ("save_policy", "write_curve"):
            patch.setattr(runner_module, name, write_or_not(getattr(runner_module, name)))
        make_runner(tmp_path).learn(5)
    runner = make_runner(tmp_path)
    runner.resume()
    runner.learn(5)
    assert_same_training(runner, uninterrupted)
    assert load_policy(tmp_path / POLICY).iteration == load_policy(tmp_path / CHECKPOINT).iteration == 5
    curves = [[point.iteration for point in read_curve(folder)] for folder in (tmp_path, uninterrupted.folder)]
    assert curves[0] == curves[1]


def test_control_c_loses_only_the_iteration_under_way(uninterrupted: Runner, tmp_path: Path) -> None:
    """The checkpoint is that of the last whole iteration, however rarely checkpoints are due."""
    rarely = staggered()
    rarely = replace(rarely, ppo=replace(rarely.ppo, save_interval=50))
    runner = make_runner(tmp_path, rarely)

    def interrupt() -> None:
        raise KeyboardInterrupt

    stop_at(runner, 4, interrupt)
    with pytest.raises(KeyboardInterrupt):
        runner.learn(5)
    assert load_policy(tmp_path / CHECKPOINT).iteration == load_policy(tmp_path / POLICY).iteration == 3
    runner = make_runner(tmp_path, rarely)
    runner.resume()
    runner.learn(5)
    assert_same_training(runner, uninterrupted)


def test_weights_that_are_no_numbers_stop_the_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What remains is the iteration before."""
    runner = make_runner(tmp_path)
    update = runner.learners.update

    def update_badly() -> dict[str, float]:
        metrics = update()
        if runner.iteration == 2:
            (learner,) = runner.learners.each
            with torch.no_grad():
                next(learner.algorithm.critic.parameters())[0, 0] = torch.nan
        return metrics

    monkeypatch.setattr(runner.learners, "update", update_badly)
    with pytest.raises(TrainingFailedError, match="iteration 3: expected finite weights and losses"):
        runner.learn(5)
    checkpoint = load_policy(tmp_path / CHECKPOINT)
    assert checkpoint.iteration == 2 and checkpoint.learner is not None
    critic = checkpoint.learner["learners"]["right"]["critic"]
    assert all(torch.isfinite(values).all() for values in critic.values())
