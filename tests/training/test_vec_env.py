"""What rsl-rl's learner is given."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import warp as wp

from artigrasp.kernels.layout import FEATURE_COUNT
from artigrasp.tasks import get_task
from artigrasp.training.processes import mean_of
from artigrasp.training.vec_env import HandVecEnv
from tests.training.examples import WORLD_COUNT, make_env, make_new_env, small_paper, small_synergy


@pytest.fixture
def env() -> HandVecEnv:
    """Our task: two decisions of ten control steps per episode, and an outcome that is rewarded."""
    return make_env(small_synergy())


def break_world(env: HandVecEnv, world: int) -> None:
    """Let the physics of one world fail in its next step."""
    environment = env.environment
    speed = environment.state.hands.joint_qd.numpy().copy()
    speed[world, 0, 10] = np.nan
    environment.state.hands.joint_qd.assign(speed)
    mask = np.arange(WORLD_COUNT) == world
    environment.simulation.write_state(wp.array(mask, dtype=int, device=environment.device))


def test_shapes_and_types(env: HandVecEnv) -> None:
    """One row per world and hand, of the types that rsl-rl stores."""
    assert (env.num_envs, env.num_actions, env.max_episode_length) == (WORLD_COUNT, 12, 2)
    observations = env.get_observations()
    assert observations.batch_size == (WORLD_COUNT,) and observations["policy"].shape == (WORLD_COUNT, FEATURE_COUNT)
    observations, rewards, dones, extras = env.step(torch.zeros(WORLD_COUNT, 12))
    assert observations["policy"].shape == (WORLD_COUNT, FEATURE_COUNT) and rewards.dtype == torch.float32
    for vector in (rewards, dones, extras["time_outs"]):
        assert vector.shape == (WORLD_COUNT,)
    assert dones.dtype == torch.long


def test_observations_are_copies(env: HandVecEnv) -> None:
    """What the learner stored does not change when the environment goes on."""
    before = env.get_observations()["policy"]
    kept = before.clone()
    after = env.step(torch.ones(WORLD_COUNT, 12))[0]["policy"]
    assert torch.equal(before, kept) and not torch.equal(after, kept)
    rewards = env.step(torch.ones(WORLD_COUNT, 12))[1]
    kept = rewards.clone()
    env.step(torch.ones(WORLD_COUNT, 12))
    assert torch.equal(rewards, kept)


def test_rewards_within_a_decision_are_discounted() -> None:
    """The control steps under one decision earn the sum of gamma^i r_i, as the same steps one by one show."""
    gamma = 0.9
    task = small_synergy(interval=10)
    task = replace(task, ppo=replace(task.ppo, gamma=gamma), reward=small_paper().reward)
    env, stepwise = make_new_env(task), make_new_env(task)
    actions = torch.from_numpy(np.random.default_rng(0).normal(size=(WORLD_COUNT, 12)).astype(np.float32))
    rewards = env.step(actions)[1]
    expected = np.zeros(WORLD_COUNT)
    for i in range(10):
        stepwise.environment.step(wp.array(actions.numpy()[:, None], dtype=float, device="cpu"))
        expected += gamma**i * stepwise.environment.reward.numpy()[:, 0]
    assert np.ptp(expected) > 0.0
    np.testing.assert_allclose(rewards.numpy(), expected, rtol=1e-5)


def test_episodes_end_together_and_begin_anew(env: HandVecEnv) -> None:
    """The last decision is done, what follows is the first observation of the next episode."""
    first = env.get_observations()["policy"]
    dones = [env.step(torch.zeros(WORLD_COUNT, 12))[2] for _ in range(4)]
    assert [done.tolist() for done in dones] == [[0] * WORLD_COUNT, [1] * WORLD_COUNT] * 2
    assert env.environment.episode.numpy().tolist() == [3] * WORLD_COUNT
    assert not env.environment.step_count.numpy().any() and not env.episode_length_buf.any()
    again = env.get_observations()["policy"]
    assert again.shape == first.shape and not torch.equal(again, first)


@pytest.mark.parametrize(("task", "expected"), [(small_synergy(), 0.0), (small_paper(), 1.0)], ids=["outcome", "paper"])
def test_a_time_limit_is_no_end_unless_the_outcome_is_rewarded(task: object, expected: float) -> None:
    """The paper's episodes could go on, so their value is added; an outcome that was paid is the end."""
    env = make_env(task)
    for step in range(env.max_episode_length):
        _, _, dones, extras = env.step(torch.zeros(WORLD_COUNT, env.num_actions))
        last = step == env.max_episode_length - 1
        assert dones.tolist() == [int(last)] * WORLD_COUNT
        assert extras["time_outs"].tolist() == [expected if last else 0.0] * WORLD_COUNT


@pytest.mark.parametrize("task", [small_synergy(), small_paper()], ids=["outcome", "paper"])
def test_failed_worlds_teach_nothing(task: object) -> None:
    """A world whose physics failed starts again, earns what was expected of it, and never shows what is no number."""
    env = make_env(task)
    break_world(env, 2)
    observations, rewards, dones, extras = env.step(torch.zeros(WORLD_COUNT, env.num_actions))
    failed = torch.arange(WORLD_COUNT) == 2
    assert torch.equal(dones.bool(), failed) and torch.equal(extras["time_outs"].bool(), failed)
    assert rewards[2] == 0.0 and (rewards[~failed] != 0.0).all()
    assert torch.isfinite(rewards).all() and torch.isfinite(observations["policy"]).all()
    assert env.episode_length_buf.tolist() == [0 if each else 1 for each in failed]
    assert env.environment.step_count.numpy()[2] == 0 and not env.environment.metrics.failure.numpy().any()
    means = mean_of([env.pop_episode_totals()])
    assert means["Episode/failed"] == 1.0 and means["Episode/success"] == 0.0
    assert all(np.isfinite(value) for value in means.values())
    assert not any("eward" in name for name in means), "no sound episode ended"


def test_means_are_over_episodes(env: HandVecEnv) -> None:
    """Each episode counts once, whenever it ended; the reward terms of sound ones add up to what was earned."""
    ppo = replace(env.task.ppo, gamma=1.0)
    env = make_env(replace(env.task, ppo=ppo))
    break_world(env, 0)
    earned = torch.zeros(WORLD_COUNT)
    for _ in range(2):
        earned += env.step(torch.zeros(WORLD_COUNT, 12))[1]
    means = mean_of([env.pop_episode_totals()])
    assert means["Episode/failed"] == pytest.approx(1 / WORLD_COUNT), "five whole episodes and one that failed"
    terms = sum(value for name, value in means.items() if name.startswith("Reward/"))
    assert terms == pytest.approx(float(earned[1:].mean()), rel=1e-4)
    assert means["Episode/reward"] == pytest.approx(terms, rel=1e-4)
    assert mean_of([env.pop_episode_totals()]) == {}


def test_each_kind_of_reference_shows_its_own_success() -> None:
    """Hinges count where they should move, lifting where the object should be lifted."""
    env = make_new_env(replace(get_task("both-free"), episode_steps=3, world_count=WORLD_COUNT))
    worlds = env.environment
    kinds = np.where(np.arange(len(worlds.references[0])) == 1, "grasp", "articulate")
    worlds.references = (replace(worlds.references[0], kind=kinds),)
    env = HandVecEnv(worlds)
    grasps = int((worlds.reference_index.numpy() == 1).sum())
    for _ in range(3):
        env.step(torch.zeros(env.rows, env.num_actions))
    totals = env.pop_episode_totals()
    assert 0 < grasps < WORLD_COUNT
    assert totals["Episode/lifted"] == (0.0, grasps)
    assert totals["Episode/success"][1] == totals["Episode/angle_error"][1] == WORLD_COUNT - grasps
    assert totals["Episode/failed"] == (0.0, WORLD_COUNT)
    assert totals["Episode/reward"][1] == 2 * WORLD_COUNT


def test_references_that_fail_are_practised_more() -> None:
    """What fails weighs more than what succeeds at the next reset, and a run that is resumed remembers it."""
    task = replace(small_synergy(), practice=1.0)
    env = make_new_env(task)
    worlds = env.environment
    count = len(worlds.references[0])
    assert count > 1
    worlds.reference_weight.assign(np.arange(count) == 1)
    worlds.reset()
    np.testing.assert_array_equal(worlds.reference_index.numpy(), 1)
    for _ in range(env.max_episode_length):
        env.step(torch.zeros(env.rows, env.num_actions))
    reached = env.pop_episode_totals()["Episode/success"][0]
    expected = np.ones(count)
    expected[1] = 0.8**WORLD_COUNT + (1 - 0.8**WORLD_COUNT) * (1 - reached / WORLD_COUNT)
    np.testing.assert_allclose(worlds.reference_weight.numpy(), np.maximum(expected, 0.02), rtol=1e-6)
    other = make_new_env(task)
    other.load_state_dict(env.state_dict())
    np.testing.assert_array_equal(other.environment.reference_weight.numpy(), worlds.reference_weight.numpy())
    np.testing.assert_array_equal(other.environment.reference_index.numpy(), worlds.reference_index.numpy())


def test_worlds_in_the_middle_of_episodes_go_on() -> None:
    """Everything that a step depends on is in the state, also of worlds that began anew at other times."""
    task = small_paper()
    first, second = make_new_env(task), make_new_env(task)
    actions = torch.randn(12, first.rows, first.num_actions, generator=torch.Generator().manual_seed(0))
    for step in range(4):
        if step == 2:
            break_world(first, 1)
        first.step(actions[step])
    assert len(set(first.episode_length_buf.tolist())) == 2
    state = first.state_dict()
    for step in range(3):
        second.step(actions[7 + step])
    second.load_state_dict(state)
    first.pop_episode_totals(), second.pop_episode_totals()
    for step in range(4, 12):
        found, expected = second.step(actions[step]), first.step(actions[step])
        assert torch.equal(found[0]["policy"], expected[0]["policy"])
        assert torch.equal(found[1], expected[1]) and torch.equal(found[2], expected[2])
    assert second.pop_episode_totals() == first.pop_episode_totals()
    assert "worlds" not in make_env(task).state_dict(), "between episodes there is nothing to keep"


def test_other_worlds_do_not_fit() -> None:
    """The state of more worlds, or of other hands, is refused."""
    first, second = make_new_env(small_paper()), make_new_env(replace(small_paper(), world_count=4))
    first.step(torch.zeros(first.rows, first.num_actions))
    with pytest.raises((ValueError, KeyError)):
        second.load_state_dict(first.state_dict())
