"""PPO in a run folder: it learns, it can be stopped and taken up again, and its files are whole."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from rsl_rl.algorithms import PPO
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from artigrasp.config import ReplayConfig, TaskConfig
from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.errors import UserError
from artigrasp.tasks import get_task
from artigrasp.training import learning_curve
from artigrasp.training import runner as runner_module
from artigrasp.training.evaluation import read_evaluations
from artigrasp.training.runner import BEST_POLICY, CHECKPOINT, POLICY, IterationReport, Runner
from tests.training.examples import WORLD_COUNT, make_env, make_new_env, small_paper, small_synergy

FILES = ["latest.pt", "learning_curve.csv", "learning_curve.png", "policy.pt"]


@pytest.fixture(autouse=True)
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes longer than training here; the curve's own tests draw it."""
    monkeypatch.setattr(learning_curve, "plot_curves", lambda target, runs, title: target.touch())


def bandit() -> TaskConfig:
    """One decision per episode and iteration, observations normalised, a checkpoint now and then."""
    task = small_synergy(interval=20)
    return replace(task, ppo=replace(task.ppo, save_interval=2))


def make_runner(task: TaskConfig, folder: Path, seed: int = 0) -> Runner:
    """A learner at its beginning."""
    return Runner(make_env(task, seed), folder, seed)


def weights(runner: Runner) -> dict[str, torch.Tensor]:
    """Everything that was learned, the normaliser's statistics included."""
    return {
        f"{each.name}.{model}.{key}": value
        for each in runner.learners.each
        for model in ("actor", "critic")
        for key, value in getattr(each.algorithm, model).state_dict().items()
    }


def only_learner(runner: Runner) -> PPO:
    """rsl-rl's learner of a task with one."""
    (learner,) = runner.learners.each
    return learner.algorithm


def assert_equal_weights(found: dict[str, torch.Tensor], expected: dict[str, torch.Tensor]) -> None:
    """Bit for bit."""
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert torch.equal(found[name], value), name


def both_hands(policies: str) -> TaskConfig:
    """The paper's second phase with short episodes, one of them per iteration."""
    task = get_task("both-free")
    ppo = replace(task.ppo, steps_per_env=6, save_interval=2)
    return replace(task, episode_steps=6, world_count=WORLD_COUNT, ppo=ppo, policies=policies)


@pytest.mark.parametrize(
    "task",
    [bandit(), small_paper(), both_hands("per-hand"), both_hands("mirrored")],
    ids=["bandit", "paper", "per-hand", "mirrored"],
)
def test_a_resumed_run_goes_on_as_if_never_stopped(task: TaskConfig, tmp_path: Path) -> None:
    """Two and two iterations of learners and environments that share nothing are the four of one run, bit for bit."""
    whole = Runner(make_new_env(task), tmp_path / "whole", seed=0)
    reports: list[IterationReport] = []
    whole.learn(4, reports.append)
    assert [report.iteration for report in reports] == [1, 2, 3, 4]
    Runner(make_new_env(task), tmp_path / "parts", seed=0).learn(2)
    resumed = Runner(make_new_env(task), tmp_path / "parts", seed=0)
    torch.rand(17)  # whatever else was drawn meanwhile
    resumed.resume()
    assert (resumed.iteration, resumed.control_steps) == (2, 2 * WORLD_COUNT * task.episode_steps)
    later: list[IterationReport] = []
    resumed.learn(4, later.append)
    assert [report.iteration for report in later] == [3, 4]
    assert_equal_weights(weights(resumed), weights(whole))
    for found, expected in zip(later, reports[2:], strict=True):
        kept = [name for name in expected.metrics if not name.startswith("Time/")]
        assert {name: found.metrics[name] for name in kept} == {name: expected.metrics[name] for name in kept}
    assert [point.iteration for point in resumed.curve] == [1, 2, 3, 4]
    assert [point.success for point in resumed.curve] == [point.success for point in whole.curve]
    assert resumed.wall_time > later[-1].collect_time


def test_seeds_differ(tmp_path: Path) -> None:
    """The seed decides weights and exploration."""
    first, second = (weights(make_runner(small_paper(), tmp_path, seed)) for seed in (0, 1))
    assert any(not torch.equal(first[name], second[name]) for name in first)


def test_training_moves_the_policy_and_fills_the_folder(tmp_path: Path) -> None:
    """Weights change, the curve has a point per iteration, TensorBoard has its scalars, and nothing lies about."""
    runner = make_runner(bandit(), tmp_path / "run")
    assert not (tmp_path / "run").exists(), "nothing is written before there is something to write"
    before = {name: value.clone() for name, value in weights(runner).items()}
    runner.learn(3)
    after = weights(runner)
    assert any(not torch.equal(after[name], before[name]) for name in before if "mlp" in name)
    assert all(torch.isfinite(value).all() for value in after.values())
    assert [point.iteration for point in runner.curve] == [1, 2, 3]
    events = [path for path in (tmp_path / "run").iterdir() if "tfevents" in path.name]
    assert sorted(path.name for path in (tmp_path / "run").iterdir() if path not in events) == FILES
    scalars = EventAccumulator(str(tmp_path / "run"))
    scalars.Reload()
    assert set(scalars.Tags()["scalars"]) >= {"Episode/success", "Reward/outcome_error", "Loss/value", "Policy/std"}
    assert [event.step for event in scalars.Scalars("Episode/success")] == [20 * WORLD_COUNT * i for i in (1, 2, 3)]


def test_checkpoint_and_policy_are_of_the_same_iteration(tmp_path: Path) -> None:
    """The policy to act with is the checkpoint without the learner's state."""
    runner = make_runner(bandit(), tmp_path)
    runner.learn(3)
    checkpoint, policy = load_policy(tmp_path / CHECKPOINT), load_policy(tmp_path / POLICY)
    assert checkpoint.iteration == policy.iteration == 3
    assert checkpoint.learner is not None and policy.learner is None
    assert (policy.hand, policy.objects, policy.seed, policy.task) == ("open", ("lidded-box",), 0, runner.task)
    assert policy.actors.keys() == {"right"}
    assert_equal_weights(policy.actors["right"], dict(only_learner(runner).actor.state_dict()))


def test_a_checkpoint_is_whole_or_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A write that fails half way leaves the checkpoint before, from which the run can be taken up again."""
    runner = make_runner(bandit(), tmp_path)
    runner.learn(2)

    def fail(contents: object, path: Path) -> None:
        path.write_bytes(b"half")
        raise OSError("no space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(torch, "save", fail)
        with pytest.raises(OSError, match="no space left"):
            runner.learn(4)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    again = make_runner(bandit(), tmp_path)
    again.resume()
    assert again.iteration == 2


def test_iterations_after_the_checkpoint_leave_the_curve(tmp_path: Path) -> None:
    """A run that broke off after its checkpoint forgets what came after it."""
    runner = make_runner(bandit(), tmp_path)
    runner.learn(3)
    points = runner.curve
    save_policy(replace(load_policy(tmp_path / CHECKPOINT), iteration=2), tmp_path / CHECKPOINT)
    again = make_runner(bandit(), tmp_path)
    again.resume()
    assert [point.wall_time for point in again.curve] == [point.wall_time for point in points[:2]]


def test_iterations_without_an_ended_episode_have_no_point(tmp_path: Path) -> None:
    """No success was measured there, and none is made up."""
    task = small_paper()
    runner = make_runner(replace(task, ppo=replace(task.ppo, steps_per_env=4)), tmp_path)
    runner.learn(3)
    assert [point.iteration for point in runner.curve] == [2, 3]


def test_discounting_is_per_control_step(tmp_path: Path) -> None:
    """The learner's discount from one decision to the next is gamma to the number of control steps between."""
    task = small_synergy(interval=5)
    task = replace(task, ppo=replace(task.ppo, gamma=0.9))
    assert only_learner(make_runner(task, tmp_path)).gamma == pytest.approx(0.9**5)


def test_the_learner_has_the_papers_settings(tmp_path: Path) -> None:
    """What the task says reaches rsl-rl."""
    task = small_paper()
    learner, ppo = only_learner(make_runner(task, tmp_path)), task.ppo
    found = (learner.num_learning_epochs, learner.num_mini_batches, learner.clip_param, learner.lam)
    assert found == (ppo.epochs, ppo.mini_batches, ppo.clip, ppo.gae_lambda)
    assert (learner.value_loss_coef, learner.entropy_coef, learner.max_grad_norm) == (0.5, 0.0, 0.5)
    assert (learner.schedule, learner.desired_kl, learner.learning_rate) == ("adaptive", 0.01, 5e-4)
    sizes = [module.out_features for module in learner.actor.mlp if isinstance(module, torch.nn.Linear)]
    assert sizes == [128, 128, 51] and learner.storage.num_transitions_per_env == ppo.steps_per_env


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"task": small_paper()}, "task: expected a policy for 'right-fixed-synergy', found one for 'right-fixed'"),
        ({"objects": ("box",)}, "objects: expected lidded-box, found box"),
        ({"hand": "mano"}, "hand: expected open, found mano"),
        ({"learner": None}, "expected a checkpoint with the learner's state, found a policy for inference"),
        (
            {"learner": {}},
            "expected the state of this run's learner, found another, perhaps an older version's: no 'processes'; "
            "--start-from begins a new run with its networks",
        ),
    ],
)
def test_what_is_no_checkpoint_of_the_run_is_refused(tmp_path: Path, changes: dict, message: str) -> None:
    """Another task, other objects, another hand, a policy without learner: one line names the file and both."""
    runner = make_runner(bandit(), tmp_path)
    runner.save()
    policy = load_policy(tmp_path / CHECKPOINT)
    if "task" in changes:
        changes["actors"] = make_runner(changes["task"], tmp_path).learners.actors()
    save_policy(replace(policy, **changes), tmp_path / CHECKPOINT)
    with pytest.raises(UserError) as caught:
        make_runner(bandit(), tmp_path).resume()
    assert str(caught.value) == f"{tmp_path / CHECKPOINT}: {message}"


def test_a_checkpoint_of_other_worlds_is_refused(tmp_path: Path) -> None:
    """The number of worlds is part of the run."""
    make_runner(bandit(), tmp_path).save()
    fewer = make_runner(replace(bandit(), world_count=4), tmp_path)
    with pytest.raises(UserError, match="expected the state of this run's learner, found another"):
        fewer.resume()


def test_there_must_be_a_checkpoint(tmp_path: Path) -> None:
    """An empty folder cannot be resumed."""
    with pytest.raises(UserError, match=f"{CHECKPOINT}: expected a policy file, found none"):
        make_runner(bandit(), tmp_path).resume()


def test_wall_time_is_training_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Time counts while collecting and learning only."""
    clock = iter(np.arange(100.0))
    monkeypatch.setattr(runner_module.time, "perf_counter", lambda: next(clock))
    runner = make_runner(bandit(), tmp_path)
    runner.learn(2)
    assert runner.wall_time == 4.0


def test_only_learning_uses_all_threads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While experience is collected the cores are the physics'."""
    runner = Runner(make_env(bandit()), tmp_path, seed=0, thread_count=2)
    threads = []
    for name in ("act", "update"):
        call = getattr(only_learner(runner), name)
        monkeypatch.setattr(
            only_learner(runner),
            name,
            lambda *args, call=call: (threads.append(torch.get_num_threads()), call(*args))[1],
        )
    runner.iterate()
    assert (threads, torch.get_num_threads()) == ([1, 2], 1)


@dataclass(frozen=True)
class ScriptedEvaluation:
    """Says what it is told to, evaluation by evaluation."""

    rates: list[float]

    def measure(self, policy: PolicyFile) -> dict[str, float]:
        """The next rate."""
        return {"suc_a": self.rates.pop(0)}


def test_the_best_policy_is_kept(tmp_path: Path) -> None:
    """The one that was measured best, across a resume; measuring takes no training time and changes nothing."""
    task = bandit()
    task = replace(task, ppo=replace(task.ppo, evaluation_interval=2))

    def make(*rates: float) -> Runner:
        return Runner(make_env(task), tmp_path, 0, evaluation=ScriptedEvaluation(list(rates)))

    runner = make(0.2, 0.6, 0.4)
    runner.learn(5)
    assert [(point.iteration, point.suc_a) for point in runner.evaluations] == [(2, 0.2), (4, 0.6), (5, 0.4)]
    assert load_policy(tmp_path / BEST_POLICY).iteration == 4
    resumed = make(0.5, 0.7)
    resumed.resume()
    resumed.learn(6)
    assert load_policy(tmp_path / BEST_POLICY).iteration == 4
    resumed.learn(8)
    assert load_policy(tmp_path / BEST_POLICY).iteration == 8
    assert [point.suc_a for point in read_evaluations(tmp_path)] == [0.2, 0.6, 0.4, 0.5, 0.7]
    plain = make_runner(bandit(), tmp_path / "plain")
    plain.learn(5)
    assert [point.reward for point in plain.curve] == [point.reward for point in runner.curve]


def test_training_begins_where_another_ended(tmp_path: Path) -> None:
    """From a checkpoint come actor and critic, from a policy the actor; from a policy for the other hand nothing."""
    make_runner(bandit(), tmp_path / "first").learn(1)
    checkpoint = load_policy(tmp_path / "first" / CHECKPOINT)
    for name in (CHECKPOINT, POLICY):
        runner = make_runner(bandit(), tmp_path / "second", seed=1)
        fresh = {key: value.clone() for key, value in only_learner(runner).critic.state_dict().items()}
        runner.start_from(tmp_path / "first" / name)
        assert runner.iteration == 0
        assert_equal_weights(dict(only_learner(runner).actor.state_dict()), checkpoint.actors["right"])
        critic = checkpoint.learner["learners"]["right"]["critic"] if name == CHECKPOINT else fresh
        assert_equal_weights(dict(only_learner(runner).critic.state_dict()), critic)
    left = replace(checkpoint, task=replace(checkpoint.task, hands=("left",)), learner=None)
    save_policy(replace(left, actors={"left": checkpoint.actors["right"]}), tmp_path / "left.pt")
    with pytest.raises(UserError, match=r"left.pt: networks: expected some of right, found left"):
        runner.start_from(tmp_path / "left.pt")
    with pytest.raises(UserError, match="expected networks of this task's shape, found others"):
        make_runner(small_paper(), tmp_path / "third").start_from(tmp_path / "first" / POLICY)


def test_learning_from_replay_begins_with_what_another_tried(tmp_path: Path) -> None:
    """From a checkpoint come decisions and critics, too; from a policy the actor alone."""
    task = replace(bandit(), replay=ReplayConfig(updates=2, random_iterations=1))
    make_runner(task, tmp_path / "first").learn(1)
    checkpoint = load_policy(tmp_path / "first" / CHECKPOINT)
    for name, decisions in ((CHECKPOINT, 2), (POLICY, 1)):
        runner = make_runner(task, tmp_path / name, seed=1)
        runner.start_from(tmp_path / "first" / name)
        assert_equal_weights(dict(only_learner(runner).actor.state_dict()), checkpoint.actors["right"])
        runner.learn(1)
        memory = only_learner(runner).state_dict()["memory"]["reward"]
        assert len(memory) == decisions * len(checkpoint.learner["learners"]["right"]["memory"]["reward"])
