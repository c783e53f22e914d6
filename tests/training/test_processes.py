"""Two processes, each with half of the worlds, learn what one with all of them does."""

import os
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensordict import TensorDict

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.network import OBSERVATION_GROUP
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT, FEATURE_COUNT
from artigrasp.tasks import get_task
from artigrasp.training.learners import Learners
from artigrasp.training.processes import ALONE, Processes, joined_processes, mean_of

WORLDS, STEPS = 8, 3
ROOT = Path(__file__).parents[2]


def learn(processes: Processes, updates: int = 2) -> dict[str, torch.Tensor]:
    """Weights after some updates from this process's share of the worlds; what is tried is the same for everybody."""
    task = get_task("right-fixed")
    ppo = replace(task.ppo, steps_per_env=STEPS, epochs=2, mini_batches=1, normalize_observations=True)
    share = processes.share(WORLDS)
    rows = slice(processes.rank * share, (processes.rank + 1) * share)
    random = torch.Generator().manual_seed(5)
    # worlds differ, so that half of them have other means and deviations than all
    place = torch.arange(float(WORLDS))[:, None]
    features = torch.randn(STEPS + 1, WORLDS, FEATURE_COUNT, generator=random) + place
    actions = torch.randn(STEPS, WORLDS, DOF_COUNT, generator=random)
    rewards = torch.randn(STEPS, WORLDS, generator=random) * (1 + place[:, 0])
    observations = [TensorDict({OBSERVATION_GROUP: each[rows]}, batch_size=share) for each in features]
    torch.manual_seed(processes.rank)
    learners = Learners(replace(task, ppo=ppo), observations[0], DOF_COUNT, processes)
    algorithm = learners.each[0].algorithm
    learners.train_mode()
    nothing = torch.zeros(share)
    for _ in range(updates):
        with torch.inference_mode():
            for step in range(STEPS):
                learners.act(observations[step])
                algorithm.transition.actions = actions[step, rows]
                algorithm.transition.actions_log_prob = algorithm.actor.get_output_log_prob(actions[step, rows])
                learners.record(rewards[step, rows], nothing.long(), {"time_outs": nothing})
            learners.compute_returns(observations[STEPS])
        learners.update()
    return {
        f"{name}.{key}": value
        for name in ("actor", "critic")
        for key, value in getattr(algorithm, name).state_dict().items()
    }


def learn_in_child(folder: Path) -> None:
    """What each child process does."""
    torch.set_num_threads(1)
    with joined_processes(SimulatorConfig(threads=1)) as (processes, simulator):
        assert processes.count == 2 and simulator.threads == 1
        means = mean_of(processes.gather({"success": (float(processes.rank), 1 + 2 * processes.rank)}))
        assert means == {"success": 0.25}
        torch.save(learn(processes), folder / f"{processes.rank}.pt")


def test_two_processes_learn_as_one(tmp_path: Path) -> None:
    """Gradients, advantages, normalisers and learning rates are those of all worlds; both have the same weights."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    code = "import sys, pathlib; from tests.training.test_processes import learn_in_child as learn; "
    code += "learn(pathlib.Path(sys.argv[1]))"
    shared = {**os.environ, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port), "WORLD_SIZE": "2"}
    children = [
        subprocess.Popen(
            [sys.executable, "-c", code, tmp_path], cwd=ROOT, env={**shared, "RANK": str(rank)}, stderr=subprocess.PIPE
        )
        for rank in range(2)
    ]
    errors = [child.communicate()[1].decode() for child in children]
    assert [child.returncode for child in children] == [0, 0], errors
    first, second = (torch.load(tmp_path / f"{rank}.pt", weights_only=True) for rank in range(2))
    alone, fresh = learn(ALONE), learn(ALONE, updates=0)
    for name, value in alone.items():
        assert torch.equal(first[name], second[name]), name
        # Adam makes steps of one size of gradients that are nearly zero, so that rounding shows
        torch.testing.assert_close(first[name], value, rtol=1e-4, atol=1e-4, msg=name)
        if name.endswith("weight"):
            assert (value - fresh[name]).abs().max() > 1e-3


def test_alone_there_is_nobody_to_ask(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without torchrun everything is this process's own."""
    monkeypatch.delenv("WORLD_SIZE", raising=False)
    with joined_processes(SimulatorConfig()) as (processes, simulator):
        assert processes == ALONE and simulator == SimulatorConfig()
        assert processes.gather(3) == [3] and processes.is_first and processes.rsl_rl_settings is None


def test_worlds_must_divide() -> None:
    """Shares of different sizes would count differently."""
    assert Processes(1, 4).share(8) == 2
    with pytest.raises(UserError, match=r"worlds: expected a multiple of the number of processes \(3\), found 8"):
        Processes(0, 3).share(8)


def test_means_are_over_all_episodes() -> None:
    """A process in which more episodes ended counts for more; what nobody counted is left out."""
    assert mean_of([{"a": (1.0, 1), "b": (0.0, 0)}, {"a": (1.0, 3), "c": (2.0, 1)}]) == {"a": 0.5, "c": 2.0}
