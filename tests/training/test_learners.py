"""Who learns from which hand: a learner for each, or a mirrored one for both."""

from dataclasses import replace

import pytest
import torch
from tensordict import TensorDict

from artigrasp.config import TaskConfig
from artigrasp.controllers.mirror import mirror_actions, mirror_features
from artigrasp.controllers.network import OBSERVATION_GROUP
from artigrasp.kernels.layout import DOF_COUNT, FEATURE_COUNT
from artigrasp.tasks import get_task
from artigrasp.training.learners import Learners

WORLDS, STEPS = 5, 3
EXTRAS = {"time_outs": torch.zeros(2 * WORLDS), "active": torch.ones(2 * WORLDS)}


def two_hands(policies: str) -> TaskConfig:
    """The scene of both hands with a short collection."""
    task = get_task("both-free")
    return replace(task, policies=policies, ppo=replace(task.ppo, steps_per_env=STEPS, mini_batches=2))


def observe(seed: int) -> TensorDict:
    """Random features of both hands in every world, world by world."""
    features = torch.randn(2 * WORLDS, FEATURE_COUNT, generator=torch.Generator().manual_seed(seed))
    return TensorDict({OBSERVATION_GROUP: features}, batch_size=2 * WORLDS)


def make_learners(policies: str) -> Learners:
    """Learners at their beginning."""
    torch.manual_seed(0)
    return Learners(two_hands(policies), observe(0), DOF_COUNT)


def collect(learners: Learners) -> list[torch.Tensor]:
    """Fill the storage, rewarding each row with its number; the actions of each step."""
    rows = torch.arange(2.0 * WORLDS)
    actions = []
    with torch.inference_mode():
        for step in range(STEPS):
            actions.append(learners.act(observe(step)))
            learners.record(rows + 100 * step, torch.zeros(2 * WORLDS).long(), EXTRAS)
        learners.compute_returns(observe(STEPS))
    return actions


def test_each_hand_has_a_learner_of_its_own() -> None:
    """It gets the rows of its hand as they are, and what its actions earned."""
    learners = make_learners("per-hand")
    assert [learner.name for learner in learners.each] == ["left", "right"]
    actions = collect(learners)
    for hand, learner in enumerate(learners.each):
        storage = learner.algorithm.storage
        for step in range(STEPS):
            seen = observe(step)[OBSERVATION_GROUP][hand::2]
            assert torch.equal(storage.observations[step][OBSERVATION_GROUP], seen)
            assert torch.equal(storage.actions[step], actions[step][hand::2])
            assert storage.rewards[step, :, 0].tolist() == [2 * world + hand + 100 * step for world in range(WORLDS)]


def test_the_mirrored_learner_learns_from_both() -> None:
    """Left hands are rows too, shown as right ones; what it does for them reaches the scene mirrored."""
    learners = make_learners("mirrored")
    (learner,) = learners.each
    actions = collect(learners)
    storage, config = learner.algorithm.storage, two_hands("mirrored").action
    for step in range(STEPS):
        features = observe(step)[OBSERVATION_GROUP]
        seen, done = storage.observations[step][OBSERVATION_GROUP], storage.actions[step]
        assert torch.equal(seen[1::2], features[1::2]) and torch.equal(done[1::2], actions[step][1::2])
        assert torch.equal(seen[::2], mirror_features(features[::2]))
        assert torch.equal(mirror_actions(done[::2], features[::2], config), actions[step][::2])
        assert storage.rewards[step, :, 0].tolist() == [row + 100 * step for row in range(2 * WORLDS)]


@pytest.mark.parametrize(("policies", "suffixes"), [("per-hand", ["_left", "_right"]), ("mirrored", [""])])
def test_every_learner_learns(policies: str, suffixes: list[str]) -> None:
    """Updates change all networks and report for each; their state comes back, bit for bit."""
    learners, fresh = make_learners(policies), make_learners(policies)
    collect(learners)
    metrics = learners.update()
    assert {f"Loss/value{suffix}" for suffix in suffixes} <= set(metrics)
    assert {f"Policy/std{suffix}" for suffix in suffixes} <= set(metrics)
    for name, state in learners.actors().items():
        before = fresh.actors()[name]
        assert any(not torch.equal(state[key], before[key]) for key in state)
    fresh.load(learners.actors(), learners.state_dict())
    collect(learners), collect(fresh)
    for found, expected in zip(fresh.each, learners.each, strict=True):
        assert found.algorithm.learning_rate == expected.algorithm.learning_rate
        assert torch.equal(found.algorithm.storage.values, expected.algorithm.storage.values)


def test_states_of_other_learners_do_not_fit() -> None:
    """A mirrored policy's learner is not that of a hand."""
    mirrored, per_hand = make_learners("mirrored"), make_learners("per-hand")
    with pytest.raises(KeyError, match="left"):
        per_hand.load(mirrored.actors(), mirrored.state_dict())
