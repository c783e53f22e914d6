"""Episodes of many worlds: repeatable, independent of each other, finite, and controlled as the task says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.object import load_object
from artigrasp.config import ActionConfig, ResidualConfig, SynergyConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.action_columns import action_count
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.errors import UserError
from artigrasp.kernels.layout import FEATURE_COUNT, feature_slice
from artigrasp.kernels.rewards import TERMS
from artigrasp.references.reference import load_references
from tests.environment.examples import (
    TWO_THREADS,
    assert_same,
    box_environment,
    play,
    random_actions,
    snapshot,
    task_of,
)
from tests.example_references import RIGHT, box_references

TWO_TERMS = ActionConfig(
    wrist_prior="hinge",
    finger_prior="reference",
    synergy=SynergyConfig(decision_interval=20),
    residual=ResidualConfig(decision_interval=5),
    approach_steps=10,
    close_start=5,
    close_end=20,
)


@pytest.fixture(scope="module")
def paper() -> Environment:
    """The paper's task; tests reset it."""
    return box_environment(task_of())


@pytest.fixture(scope="module")
def two_terms() -> Environment:
    """A synergy and a residual, each with an interval of its own, and hands that touch the box soon."""
    return box_environment(task_of(episode_steps=60, action=TWO_TERMS))


def restart(environment: Environment) -> Environment:
    """Begin the first episode once more."""
    environment.episode.zero_()
    environment.reset()
    return environment


def test_the_first_episode_can_be_had_again(two_terms: Environment) -> None:
    """Nothing of an episode outlives a reset: neither decisions nor targets nor the solver's memory."""
    actions = random_actions(two_terms, 60)
    play(restart(two_terms), actions)
    first = snapshot(two_terms)
    assert np.abs(first["contact_force"]).max() > 0.1, "the hands should touch the box"
    play(two_terms, random_actions(two_terms, 7, seed=1))
    play(restart(two_terms), actions)
    assert_same(snapshot(two_terms), first)


def test_the_seed_decides_everything(two_terms: Environment) -> None:
    """Another environment of the same seed goes the same way bit for bit; another seed starts elsewhere."""
    play(restart(two_terms), random_actions(two_terms, 60))
    twin = box_environment(two_terms.task)
    twin.reset()
    play(twin, random_actions(twin, 60))
    assert_same(snapshot(twin), snapshot(two_terms))
    other = box_environment(two_terms.task, seed=1)
    other.reset()
    assert (snapshot(other)["joint_q"] != snapshot(restart(two_terms))["joint_q"]).any()


def test_resetting_some_worlds_leaves_the_others_alone(two_terms: Environment) -> None:
    """They stay as they were, and go on as if nothing had happened to their neighbours."""
    actions = random_actions(two_terms, 40)
    play(restart(two_terms), actions)
    undisturbed = snapshot(two_terms)
    play(restart(two_terms), actions[:25])
    before = snapshot(two_terms)
    mask = np.array([0, 1, 0, 0, 1, 1])
    two_terms.reset(wp.array(mask, dtype=int, device=two_terms.device))
    now = snapshot(two_terms)
    others, masked = mask == 0, mask == 1
    for name in before.keys() - {"reward", "target"}:
        np.testing.assert_array_equal(now[name][others], before[name][others], err_msg=name)
    assert two_terms.step_count.numpy().tolist() == [25, 0, 25, 25, 0, 0]
    assert two_terms.episode.numpy().tolist() == [1, 2, 1, 1, 2, 2]
    for name in ("joint_qd", "velocity", "hinge_qd", "contact_force", "max_displacement"):
        assert not now[name][masked].any(), name
    assert (now["goal_angle"][masked] != before["goal_angle"][masked]).all()
    play(two_terms, actions[25:])
    assert_same(snapshot(two_terms), undisturbed, others)


def test_a_whole_episode_is_finite(paper: Environment) -> None:
    """300 steps of the paper's task with its initial exploration: features, rewards and measurements are numbers."""
    restart(paper)
    for actions in np.split(random_actions(paper, 300), 30):
        play(paper, actions)
        state = snapshot(paper)
        for name, array in state.items():
            assert np.isfinite(array).all(), name
    assert not state["failed"].any()
    assert (paper.metrics.step_count.numpy() == 300).all()


def test_a_reference_without_target_contact(paper: Environment) -> None:
    """Its contact terms are zero, even while the hand touches the box, and everything else is as ever."""
    references = [box_references().select(indices=[0, 1])]
    environment = Environment(
        paper.task, references, trial_worlds(references, [1.0]), noise=False, simulator=TWO_THREADS
    )
    environment.reset()
    play(environment, np.zeros((80, 2, 1, 51), np.float32))
    features, terms = environment.observe().numpy(), environment.reward_terms[0][1].numpy()
    assert np.isfinite(features).all() and np.isfinite(terms).all()
    wanted = features[..., feature_slice("contact_goal")][..., :16]
    assert wanted[0].any() and not wanted[1].any()
    assert features[1, 0, feature_slice("link_forces")].max() > 0.0
    contact = [TERMS.index(name) for name in ("contact", "force")]
    assert (terms[1, 0, contact] == 0.0).all() and (np.delete(terms[1, 0], contact) != 0.0).any()


@pytest.mark.parametrize("speed", [np.nan, np.inf, 1e6, -1e12])
def test_failed_physics_is_flagged(paper: Environment, speed: float) -> None:
    """A world with an absurd velocity counts as failed; neither its summary nor its neighbours suffer."""
    actions = random_actions(paper, 4)
    play(restart(paper), actions)
    expected = snapshot(paper)
    play(restart(paper), actions[:2])
    velocity = paper.state.hands.joint_qd.numpy().copy()
    velocity[3, 0, 20] = speed
    paper.state.hands.joint_qd.assign(velocity)
    paper.simulation.write_state(wp.array([0, 0, 0, 1, 0, 0], dtype=int, device=paper.device))
    play(paper, actions[2:])
    found = snapshot(paper)
    assert found["failed"].tolist() == [0, 0, 0, 1, 0, 0] and not found["success"][3]
    assert all(np.isfinite(values).all() for values in paper.episode_summary().values())
    assert_same(found, expected, [0, 1, 2, 4, 5])
    paper.reset(wp.array([0, 0, 0, 1, 0, 0], dtype=int, device=paper.device))
    assert not snapshot(paper)["failed"].any()
    play(paper, actions)
    assert not snapshot(paper)["failed"].any() and np.isfinite(snapshot(paper)["features"]).all()


def test_decisions_hold_for_their_interval(two_terms: Environment) -> None:
    """Each term looks at its columns of the action when a decision is due, and never in between."""
    assert two_terms.action_count == action_count(TWO_TERMS) == 12 + 51
    actions = random_actions(two_terms, 45)
    play(restart(two_terms), actions)
    first = snapshot(two_terms)
    changed = random_actions(two_terms, 45, seed=1)
    changed[::20, ..., :12] = actions[::20, ..., :12]
    changed[::5, ..., 12:] = actions[::5, ..., 12:]
    play(restart(two_terms), changed)
    assert_same(snapshot(two_terms), first)
    changed[40, ..., 0] += 1.0
    play(restart(two_terms), changed)
    assert (snapshot(two_terms)["target"] != first["target"]).any(axis=(1, 2)).all()


@pytest.mark.parametrize("value", [0.0, 1.0, -2.0])
def test_the_papers_action(paper: Environment, value: float) -> None:
    """Targets: the reference position on the part as it is, else the current angles, plus 1 mm, 0.01 and 0.015 rad."""
    play(restart(paper), random_actions(paper, 30))
    before = snapshot(paper)
    play(paper, np.full((1, 6, 1, 51), value, np.float32))
    base = before["hand_base"][:, 0]
    reference = before["wrist_pose_in_part"][:, 0, :3]
    box = load_object("lidded-box")
    lids = [box.articulated_pose_in_base(float(angle)) for angle in before["hinge_q"]]
    in_world = np.stack([at + Rotation.from_quat(q).apply(r) for (at, q), r in zip(lids, reference, strict=True)])
    in_base = Rotation.from_quat(base[:, 3:]).inv().apply(in_world - base[:, :3])
    expected = before["joint_q"][:, 0].copy()
    expected[:, :3] = in_base
    expected += value * np.array([0.001] * 3 + [0.01] * 3 + [0.015] * 45)
    limited = np.clip(expected, before["lower"][:, 0], before["upper"][:, 0])
    np.testing.assert_allclose(paper.target.numpy()[:, 0], limited, atol=2e-5)
    assert (limited == expected).mean() > 0.8


def test_the_hinge_can_be_hidden(paper: Environment) -> None:
    """The paper's ablation sees zeros in place of the hinge, and everything else as before."""
    blind = box_environment(replace(paper.task, include_hinge_features=False))
    blind.reset()
    seen, unseen = snapshot(restart(paper))["features"], snapshot(blind)["features"]
    hinge = np.zeros(seen.shape[-1], bool)
    hinge[feature_slice("hinge_in_wrist")] = True
    assert seen[..., hinge].any() and not unseen[..., hinge].any()
    np.testing.assert_array_equal(seen[..., ~hinge], unseen[..., ~hinge])


def test_rewards_add_up(two_terms: Environment) -> None:
    """The reward is the sum of its terms, those of the outcome among them."""
    reward = replace(two_terms.task.reward, outcome_error=1.0, outcome_mean_error=0.3, outcome_success=0.5)
    environment = box_environment(replace(two_terms.task, episode_steps=20, reward=reward))
    environment.reset()
    play(environment, random_actions(environment, 20))
    total = sum(values.numpy().sum(axis=-1) for _, values in environment.reward_terms)
    np.testing.assert_allclose(environment.reward.numpy(), total, rtol=1e-5)
    names, terms = environment.reward_terms[1]
    outcome = dict(zip(names, np.moveaxis(terms.numpy(), -1, 0)[..., 0], strict=True))
    error = environment.episode_summary()["angle_error"]
    np.testing.assert_allclose(outcome["outcome_error"], -error, rtol=1e-5)
    np.testing.assert_allclose(outcome["outcome_mean_error"], -0.3 * error / 20, rtol=1e-5)


def test_played_references_are_known(paper: Environment) -> None:
    """Each world's reference, as a row of its object's set, whatever the number of sets."""
    references = [box_references(), box_references().select(indices=[2, 0])]
    environment = Environment(paper.task, references, trial_worlds(references, [1.0]), simulator=TWO_THREADS)
    environment.reset()
    assert environment.reference_rows().tolist() == [0, 1, 2, 0, 1]


def test_objects_do_not_see_each_other(arctic_assets: Path) -> None:
    """Trials of box and laptop side by side go as those of the laptop alone, bit for bit."""
    controller = pd_ik_controller(task_of(episode_steps=120))
    laptop, box = (
        load_references(name).select(split="test", kind="articulate", indices=[0, 1]) for name in ("laptop", "box")
    )
    summaries = []
    for references in ([box, laptop], [laptop]):
        worlds = trial_worlds(references, [1.0])
        environment = Environment(controller.task, references, worlds, noise=False, simulator=TWO_THREADS)
        run_episode(environment, controller)
        summaries.append(environment.episode_summary())
    assert summaries[1]["max_angle_change"].max() > 0.02, "some lid should move"
    for name, values in summaries[1].items():
        np.testing.assert_array_equal(summaries[0][name][2:], values, err_msg=name)


def test_two_hands_and_a_free_base(paper: Environment) -> None:
    """Both are parameters: the hand that takes no part earns nothing and stays away, and the box stays on the table."""
    task = replace(paper.task, hands=("left", "right"), fixed_base=False)
    environment = box_environment(task, 3)
    environment.reset()
    before = snapshot(environment)
    play(environment, random_actions(environment, 60))
    after = snapshot(environment)
    assert after["features"].shape == (3, 2, FEATURE_COUNT)
    assert all(np.isfinite(array).all() for array in after.values())
    assert not after["reward"][:, 0].any() and after["reward"][:, 1].all()
    idle = np.linalg.norm(after["link_pose"][:, 0, 0, :3] - before["link_pose"][:, 0, 0, :3], axis=-1)
    assert idle.max() < 0.05 and not after["contact_force"][:, 0].any()
    assert not after["failed"].any() and after["max_displacement"].max() < 0.05
    assert (after["pose"] != before["pose"]).any()


def test_one_hand_model_for_all(paper: Environment) -> None:
    """References of different hands cannot be mixed, and those of an unknown hand not played."""
    mixed = [replace(box_references(), hand=name) for name in ("open", "mano")]
    with pytest.raises(UserError, match="references: expected one hand model for all objects, found mano, open"):
        Environment(paper.task, mixed, trial_worlds(mixed, [1.0]))
    unknown = [replace(box_references(), hand="opne")]
    with pytest.raises(UserError, match="unknown hand 'opne_right': did you mean 'open_right'"):
        Environment(paper.task, unknown, trial_worlds(unknown, [1.0]))


def test_the_right_hand_is_the_second_of_a_reference(paper: Environment) -> None:
    """A scene with the right hand alone plays the right hand's reference."""
    restart(paper)
    rows = paper.reference_rows()
    expected = box_references().finger_angles[rows, RIGHT]
    np.testing.assert_allclose(paper.goal.finger_angles.numpy()[:, 0], expected, atol=1e-6)
