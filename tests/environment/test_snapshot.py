"""Environments that go on from where another was, in the middle of episodes."""

import re
from typing import Any

import numpy as np
import pytest

from artigrasp.config import ActionConfig, PDGain, PDGains, PhaseConfig, ResidualConfig, SynergyConfig, TaskConfig
from artigrasp.environment.snapshot import restore_snapshot, take_snapshot
from tests.environment.examples import assert_same, box_environment, play, random_actions, snapshot, task_of

REACH = ActionConfig(wrist_prior="hinge", finger_prior="reference", residual=None, approach_steps=10)
CARRY = ActionConfig(wrist_prior="transport", finger_prior="closed", residual=None)
HELD = ActionConfig(
    finger_prior="reference", synergy=SynergyConfig(decision_interval=8), residual=ResidualConfig(decision_interval=2)
)
STIFFER = PDGains(wrist_translation=PDGain(60.0, 1.0))


@pytest.mark.parametrize(
    ("task", "options"),
    [
        (task_of(episode_steps=16, action=HELD), {}),
        (
            task_of("both-free"),
            {"sequence": [PhaseConfig("reach", 7, action=REACH), PhaseConfig("carry", 9, action=CARRY, gains=STIFFER)]},
        ),
    ],
    ids=["decisions that hold", "phases"],
)
def test_it_goes_on_as_the_other(task: TaskConfig, options: dict[str, Any]) -> None:
    """Bit for bit: decisions in force, references drawn and what became of phases are part of where it was."""
    first, second = (box_environment(task, **options) for _ in range(2))
    first.reset()
    actions = random_actions(first, 14)
    play(first, actions[:4])
    kept = take_snapshot(first)
    for _ in range(2):
        second.reset()
    assert (second.reference_index.numpy() != first.reference_index.numpy()).any(), "it should have drawn others"
    play(second, random_actions(second, 9, seed=1))
    restore_snapshot(second, kept)
    for each in (first, second):
        play(each, actions[4:])
    assert_same(snapshot(second), snapshot(first))
    for name in ("reference_index", "phase_outcome", "stiffness"):
        np.testing.assert_array_equal(getattr(second, name).numpy(), getattr(first, name).numpy(), err_msg=name)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("machine.reference_index", 10**6, "machine.reference_index: expected 0 to 2, found 1000000 to 1000000"),
        ("phase.index", -1, "phase.index: expected 0 to 0, found -1 to -1"),
        ("goal.contact_part", 2, "goal.contact_part: expected -1 to 1, found 2 to 2"),
        ("environment._reference_count", 10**6, "environment._reference_count: expected that of these objects"),
    ],
)
def test_no_index_leads_out_of_what_there_is(name: str, value: int, message: str) -> None:
    """Kernels would read, and write, wherever it leads."""
    environment = box_environment(task_of())
    environment.reset()
    snapshot = take_snapshot(environment)
    restore_snapshot(environment, snapshot)
    with pytest.raises(ValueError, match=re.escape(message)):
        restore_snapshot(environment, snapshot | {name: np.full_like(snapshot[name], value)})
    with pytest.raises(ValueError, match="expected int32 of shape"):
        restore_snapshot(environment, snapshot | {name: snapshot[name].astype(np.float32)})
