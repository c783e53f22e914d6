"""Learning from replay."""

import copy
from dataclasses import replace

import pytest
import torch
from tensordict import TensorDict

from artigrasp.config import PPOConfig, ReplayConfig
from artigrasp.config.checks import FieldError
from artigrasp.controllers.network import OBSERVATION_GROUP
from artigrasp.training.replay import Critics, Replay

OBSERVED = ("angle_error", "wrist_error_in_part")
OBSERVATIONS, ACTIONS, ROWS = 4, 2, 64
PPO = PPOConfig(hidden_sizes=(32,), observed_features=OBSERVED, normalize_observations=True, init_std=1.0)
REPLAY = ReplayConfig(
    critic_count=3, critic_size=32, batch_size=64, updates=60, random_iterations=4, dropout=0.0, weight_decay=0.0
)


def observe(rows: torch.Tensor) -> TensorDict:
    """Observations as learners get them."""
    return TensorDict({OBSERVATION_GROUP: rows}, batch_size=len(rows))


def extras(time_outs: torch.Tensor | None = None, active: torch.Tensor | None = None) -> dict[str, torch.Tensor]:
    """Nothing was cut short and all hands take part, unless told otherwise."""
    return {
        "time_outs": torch.zeros(ROWS) if time_outs is None else time_outs,
        "active": torch.ones(ROWS) if active is None else active,
    }


def wanted(rows: torch.Tensor) -> torch.Tensor:
    """The best decision in these observations."""
    return rows[:, :ACTIONS] * 0.5


def train(replay: Replay, iterations: int, seed: int = 0) -> None:
    """Decisions that end their episode and earn the more the nearer they are to the wanted ones."""
    torch.manual_seed(seed)
    for _ in range(iterations):
        with torch.inference_mode():
            rows = torch.randn(ROWS, OBSERVATIONS)
            actions = replay.act(observe(rows))
            rewards = -(actions - wanted(rows)).square().sum(dim=1)
            replay.process_env_step(observe(rows), rewards, torch.ones(ROWS).long(), extras())
            replay.compute_returns(observe(torch.randn(ROWS, OBSERVATIONS)))
        replay.update()


def make(seed: int = 0) -> Replay:
    """A learner with new networks."""
    torch.manual_seed(seed)
    return Replay(REPLAY, PPO, 1.0, OBSERVATIONS, ACTIONS)


def regret(replay: Replay) -> float:
    """What the actor's decisions earn less than the best, on average."""
    rows = torch.randn(512, OBSERVATIONS, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        actions = replay.actor.eval()(observe(rows))
    replay.actor.train()
    return float((actions - wanted(rows)).square().sum(dim=1).mean())


def test_actor_learns_what_earns_most() -> None:
    """After some hundred decisions it is near the best, which the untrained one is not."""
    replay = make()
    before = regret(replay)
    train(replay, 16)
    assert regret(replay) < 0.25 * before


def test_what_follows_counts_as_far_as_the_discount_goes() -> None:
    """The return of a decision that ends no episode holds the discounted value of the next."""
    replay = make()
    replay.gamma = 0.5
    following, rewards = torch.randn(ROWS, OBSERVATIONS), torch.randn(ROWS)
    last = torch.zeros(ROWS)
    last[: ROWS // 2] = 1.0
    with torch.no_grad():
        next_values = replay._target_critics(following, replay.actor.mlp(following)).mean(dim=0)
    expected = rewards + torch.where(last > 0, 0.0, 0.5 * next_values)
    # dropout is off in these settings
    torch.testing.assert_close(replay._returns(rewards, following, last), expected)


def test_failed_episodes_and_idle_hands_are_forgotten() -> None:
    """What is kept are the rows that were played to their end by hands that take part, each with what followed it."""
    replay = make()
    first, second = torch.randn(ROWS, OBSERVATIONS), torch.randn(ROWS, OBSERVATIONS)
    time_outs, active = torch.zeros(ROWS), torch.ones(ROWS)
    time_outs[:10], active[20:30] = 1.0, 0.0
    kept = (time_outs == 0) & (active != 0)
    actions = replay.act(observe(first))
    replay.process_env_step(observe(second), torch.arange(ROWS).float(), torch.zeros(ROWS), extras(time_outs, active))
    replay.compute_returns(observe(second))
    replay.update()
    expected = (first, actions, torch.arange(ROWS).float(), second, torch.zeros(ROWS))
    for found, given in zip(replay._memory[0], expected, strict=True):
        assert torch.equal(found, given[kept])


def test_critics_differ_and_stay_apart() -> None:
    """Each critic is a network of its own, and values rows by themselves."""
    critics = Critics(3, OBSERVATIONS + ACTIONS, 16, dropout=0.0)
    observations, actions = torch.randn(5, OBSERVATIONS), torch.randn(5, ACTIONS)
    values = critics(observations, actions)
    assert values.shape == (3, 5)
    assert not torch.allclose(values[0], values[1])
    torch.testing.assert_close(critics(observations[:2], actions[:2]), values[:, :2])


def test_a_learner_goes_on_where_another_stopped() -> None:
    """State and actor taken up by a new learner: it learns the same from then on."""
    first, second = make(), make(seed=1)
    train(first, 6)
    second.actor.load_state_dict(first.actor.state_dict())
    second.load_state_dict(copy.deepcopy(first.state_dict()))
    for learner in (first, second):
        train(learner, 2, seed=5)
    for name, value in first.actor.state_dict().items():
        assert torch.equal(value, second.actor.state_dict()[name]), name


def test_rates_are_settings() -> None:
    """A learner that goes on from another's state learns as fast as it is told, not as the other was."""
    replay = make()
    train(replay, 1)
    cautious = Replay(replace(REPLAY, actor_rate=0.01, critic_rate=0.02), PPO, 1.0, OBSERVATIONS, ACTIONS)
    cautious.load_state_dict(replay.state_dict())
    found = cautious.state_dict()
    rates = [found[name]["param_groups"][0]["lr"] for name in ("actor_optimizer", "critic_optimizer")]
    assert rates == [0.01, 0.02]


@pytest.mark.parametrize("name", ["dropout", "average_rate"])
def test_shares_are_shares(name: str) -> None:
    """Settings out of range are refused."""
    with pytest.raises(FieldError, match=name):
        replace(REPLAY, **{name: 1.5})


def test_what_a_given_actor_does_is_tried_at_once() -> None:
    """Random decisions are for those that know nothing yet."""
    torch.manual_seed(0)
    learner = Replay(replace(REPLAY, exploration=0.0), PPO, 1.0, OBSERVATIONS, ACTIONS)
    rows = torch.randn(ROWS, OBSERVATIONS)
    learner.learn_on_from_actor()
    learner.train_mode()
    torch.testing.assert_close(learner.act(observe(rows)), learner.actor(observe(rows)))
