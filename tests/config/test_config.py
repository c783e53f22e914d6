"""Tests of the config classes themselves: the paper's numbers, ranges, and that they stay pure data."""

import dataclasses
import subprocess
import sys
from typing import Any, get_args

import pytest

from artigrasp.config import (
    ActionConfig,
    PDGain,
    PhysicsConfig,
    PPOConfig,
    ResetConfig,
    ResidualConfig,
    RewardConfig,
    SynergyConfig,
    TaskConfig,
)
from artigrasp.config.task import Side
from artigrasp.errors import UserError
from artigrasp.kernels import layout


def task(**changes: Any) -> TaskConfig:
    """A task with the paper's defaults and some changes."""
    return TaskConfig(name="right-fixed", description="A right hand opens a fixed object.", **changes)


def test_defaults_are_the_papers() -> None:
    """The supplement's table of parameters, number by number."""
    paper = task()
    assert paper.control_dt == pytest.approx(0.01)
    assert (paper.episode_steps, paper.world_count, paper.iterations) == (300, 2000, 10_000)
    ppo = paper.ppo
    assert (ppo.gamma, ppo.gae_lambda, ppo.clip, ppo.max_grad_norm) == (0.996, 0.95, 0.2, 0.5)
    assert (ppo.value_coefficient, ppo.entropy_coefficient, ppo.learning_rate) == (0.5, 0.0, 5e-4)
    assert ppo.epochs * ppo.mini_batches == 20
    assert ppo.hidden_sizes == (128, 128)
    weights = dataclasses.asdict(paper.reward)
    assert weights == {
        "keypoint": 3.0,
        "fingertip": 12.0,
        "pose": 0.2,
        "contact": 1.5,
        "force": 1.5,
        "force_cap": 5.0,
        "hand_velocity": 0.5,
        "object_velocity": 0.2,
        "angle": 1.5,
        "displacement": 0.2,
        "outcome_error": 0.0,
        "outcome_mean_error": 0.0,
        "outcome_success": 0.0,
        "outcome_displacement": 0.0,
        "outcome_lift": 0.0,
        "outcome_position_error": 0.0,
        "outcome_rotation_error": 0.0,
    }


def test_sides_are_the_layouts_hands() -> None:
    """The sides that a task may name are the hands of every array, in the same order."""
    assert get_args(Side) == layout.HANDS


def test_configs_are_frozen() -> None:
    """A config cannot be changed behind the back of who holds it."""
    with pytest.raises(dataclasses.FrozenInstanceError):
        task().physics.timestep = 1.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PhysicsConfig(timestep=0.0), "timestep: expected a positive number, found 0.0"),
        (lambda: PhysicsConfig(friction=-1.0), "friction: expected zero or a positive number, found -1.0"),
        (lambda: PhysicsConfig(solref=(0.01, -1.0)), "solref: expected two positive numbers, found (0.01, -1.0)"),
        (lambda: PhysicsConfig(solimp=(0.99, 0.9, 0.001)), "solimp: expected 0 < start <= end < 1"),
        (lambda: PDGain(kp=-1.0, kd=0.0), "kp: expected zero or a positive number, found -1.0"),
        (lambda: SynergyConfig(decision_interval=0), "decision_interval: expected a positive number, found 0"),
        (lambda: ResidualConfig(fingers=-0.1), "fingers: expected zero or a positive number, found -0.1"),
        (lambda: ActionConfig(close_start=9, close_end=8), "close_end: expected at least close_start (9), found 8"),
        (
            lambda: ActionConfig(
                synergy=SynergyConfig(decision_interval=300), residual=ResidualConfig(decision_interval=7)
            ),
            "synergy.decision_interval: expected a multiple of the other term's (7), found 300",
        ),
        (lambda: ResetConfig(open_fraction=1.5), "open_fraction: expected a number between 0 and 1, found 1.5"),
        (lambda: ResetConfig(goal_angle=(1.5, 0.5)), "goal_angle: expected 0 <= low <= high, found (1.5, 0.5)"),
        (lambda: RewardConfig(force=-1.0), "force: expected zero or a positive number, found -1.0"),
        (lambda: PPOConfig(gamma=1.1), "gamma: expected a number between 0 and 1, found 1.1"),
        (lambda: PPOConfig(gamma=float("nan")), "gamma: expected a number between 0 and 1, found nan"),
        (lambda: PPOConfig(hidden_sizes=()), "hidden_sizes: expected one or more positive whole numbers, found ()"),
        (lambda: task(hands=()), "hands: expected some of left, right, each once and in this order, found ()"),
        (lambda: task(hands=("right", "left")), "hands: expected some of left, right"),
        (lambda: task(kinds=("open",)), "kinds: expected some of articulate, grasp"),
        (
            lambda: task(episode_steps=20, action=ActionConfig(synergy=SynergyConfig())),
            "action.synergy.decision_interval: expected a divisor of episode_steps (20), found 300",
        ),
        (lambda: task(world_count=0), "world_count: expected a positive number, found 0"),
        (lambda: TaskConfig(name="Right Fixed", description=""), "name: expected lower case words joined by hyphens"),
    ],
)
def test_ranges_are_checked(make: Any, message: str) -> None:
    """Every impossible value is refused with its field, what was expected and what was found."""
    with pytest.raises(UserError) as caught:
        make()
    assert str(caught.value).startswith(message)


def test_decision_interval_is_the_shortest() -> None:
    """A policy decides as often as its fastest term; without a term there is no policy."""
    slow = SynergyConfig(decision_interval=50)
    assert ActionConfig(synergy=slow, residual=None).decision_interval == 50
    assert ActionConfig(synergy=slow, residual=ResidualConfig(decision_interval=2)).decision_interval == 2
    with pytest.raises(UserError, match="found neither"):
        _ = ActionConfig(synergy=None, residual=None).decision_interval


def test_config_imports_nothing_heavy() -> None:
    """Config classes can be read without loading the simulator, the learner or arrays."""
    heavy = ["warp", "newton", "mujoco", "torch", "numpy", "pxr"]
    program = f"import sys, artigrasp.config; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
