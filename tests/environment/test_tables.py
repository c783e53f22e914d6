"""Assets and settings as the kernels read them."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.assets.object import load_object
from artigrasp.config import (
    ActionConfig,
    PDGain,
    PDGains,
    PhaseConfig,
    ResetConfig,
    ResidualConfig,
    RewardConfig,
    SynergyConfig,
)
from artigrasp.environment import action_columns, tables
from artigrasp.environment.worlds import training_worlds
from artigrasp.errors import UserError
from artigrasp.kernels import actions
from artigrasp.kernels.outcomes import OUTCOME_TERMS
from tests.example_references import box_references


def test_every_world_has_its_objects_numbers() -> None:
    """Hinge and masses follow the plan; the force cap counts the lid alone on a fixed base, else the whole object."""
    box = load_object("lidded-box")
    heavy = replace(box, hinge_axis=-box.hinge_axis, parts=tuple(replace(p, mass=10 * p.mass) for p in box.parts))
    plan = training_worlds([box_references(), box_references()], 3)
    table = tables.object_table([box, heavy], plan, "cpu")
    np.testing.assert_allclose(table.hinge_axis.numpy(), [box.hinge_axis, box.hinge_axis, -box.hinge_axis], atol=1e-7)
    masses = np.array([part.mass for part in box.parts])
    np.testing.assert_allclose(table.part_mass.numpy(), [masses, masses, 10 * masses], rtol=1e-6)
    for fixed, mass in ((True, masses[1]), (False, masses.sum())):
        found = tables.object_mass([box, heavy], plan, fixed, "cpu").numpy()
        np.testing.assert_allclose(found, [mass, mass, 10 * mass], rtol=1e-6)


@pytest.mark.parametrize(("sides", "columns"), [(("right",), [1]), (("left", "right"), [0, 1])])
def test_references_are_cut_down_to_the_scenes_hands(sides: tuple[str, ...], columns: list[int]) -> None:
    """Sets follow each other; the hands that are not in the scene are left out."""
    first = box_references()
    second = replace(first.select(indices=[1]), kind=np.array(["grasp"]))
    table = tables.reference_table([first, second], sides, "cpu")
    assert table.articulate.numpy().tolist() == [1, 1, 1, 0]
    for name in ("active", "part", "wrist_pose_in_part", "finger_angles", "contacts"):
        expected = np.concatenate([getattr(each, name)[:, columns] for each in (first, second)])
        np.testing.assert_array_equal(getattr(table, name).numpy(), expected.astype(np.float32))
    for name in ("object_pose", "object_angle"):
        expected = np.concatenate([getattr(each, name) for each in (first, second)])
        np.testing.assert_array_equal(getattr(table, name).numpy(), expected)


def test_measuring_starts_without_noise() -> None:
    """Without noise every offset at the start is zero; with it the task's numbers hold."""
    config = ResetConfig(reference_position_noise=0.01, reference_rotation_noise=0.1)
    for noise in (True, False):
        settings = tables.reset_settings(config, noise)
        for name in ("position_noise", "angle_noise", "reference_position_noise", "reference_rotation_noise"):
            assert getattr(settings, name) == pytest.approx(getattr(config, name) if noise else 0.0)
        assert settings.pregrasp_distance == pytest.approx(config.pregrasp_distance)


def test_terms_that_are_not_in_use_have_no_scale() -> None:
    """A synergy or a residual that a task leaves out cannot move anything."""
    both = ActionConfig(
        wrist_prior="hinge", finger_prior="reference", synergy=SynergyConfig(), residual=ResidualConfig()
    )
    settings = tables.action_settings(both, ResetConfig(open_fraction=0.25), 0.01)
    priors = actions.WRIST_PRIORS[settings.wrist_prior], actions.FINGER_PRIORS[settings.finger_prior]
    assert priors == ("hinge", "reference")
    assert settings.open_fraction == 0.25
    expected = [0.015] * 3 + [0.15] * 3 + [0.3] * 5 + [0.15, 0.0, 0.0]
    np.testing.assert_allclose(list(settings.synergy_scale), expected, rtol=1e-6)
    assert min(settings.residual_scale) > 0.0
    neither = tables.action_settings(replace(both, synergy=None, residual=None), ResetConfig(), 0.01)
    assert not any(neither.synergy_scale) and not any(neither.residual_scale)


def test_directions_are_those_with_a_scale() -> None:
    """Twelve by default; two more once they have a scale; the columns are in the one order of all directions."""
    assert action_columns.synergy_directions(SynergyConfig()) == list(actions.SYNERGIES[:12])
    assert action_columns.synergy_directions(SynergyConfig(squeeze=0.1, press=0.02)) == list(actions.SYNERGIES)
    few = SynergyConfig(wrist_rotation=0.0, thumb=0.0, hinge_lead=0.0, press=0.02)
    assert action_columns.synergy_directions(few) == ["wrist_tx", "wrist_ty", "wrist_tz", "finger_flexion", "press"]
    assert action_columns.synergy_directions(None) == []
    assert action_columns.action_count(ActionConfig(synergy=few)) == 5 + 51


def test_rewards_are_the_tasks() -> None:
    """One weight serves both velocities of the wrist; outcomes are left out where none counts."""
    weights = tables.reward_weights(RewardConfig(hand_velocity=0.7, angle=2.0))
    assert weights.hand_linear_velocity == weights.hand_angular_velocity == pytest.approx(0.7)
    assert weights.angle == pytest.approx(2.0)
    assert tables.outcome_weights(RewardConfig(), "cpu") is None
    weights = tables.outcome_weights(RewardConfig(outcome_success=0.5), "cpu").numpy().tolist()
    by_name = dict(zip(OUTCOME_TERMS, weights, strict=True))
    assert by_name.pop("outcome_success") == 0.5 and not any(by_name.values())


def test_phases_have_their_own_gains_and_aims() -> None:
    """One row per phase: gains by group, the phase to go back to by its place; speeds are per control step."""
    gains = PDGains(PDGain(1.0, 2.0), PDGain(3.0, 4.0), PDGain(5.0, 6.0))
    carry = ActionConfig(wrist_prior="transport", finger_prior="closed", residual=None, carry_speed=0.2)
    phases = (
        PhaseConfig("grasp", 200, aim="grasp", opens=False),
        PhaseConfig(
            "carry", 300, carries=True, lift=0.1, reference="second", retry_from="grasp", gains=gains, action=carry
        ),
    )
    table = tables.phase_table(phases, "cpu")
    np.testing.assert_array_equal(table.stiffness.numpy(), [[50.0, 50.0, 50.0], [1.0, 3.0, 5.0]])
    np.testing.assert_allclose(table.damping.numpy(), [[0.1, 0.2, 0.2], [2.0, 4.0, 6.0]], rtol=1e-6)
    expected = {"reference": [0, 1], "aim": [1, 0], "most_steps": [200, 300], "carries": [0, 1], "opens": [0, 1]}
    expected |= {"retry_from": [-1, 0], "decides": [1, 1]}
    assert {name: getattr(table, name).numpy().tolist() for name in expected} == expected
    settings = tables.action_settings(carry, ResetConfig(), 0.01)
    assert settings.speed == pytest.approx(0.002)
    with pytest.raises(UserError, match="unknown phase to try again from 'grap': did you mean 'grasp'"):
        tables.phase_table((*phases, replace(phases[1], retry_from="grap")), "cpu")


def test_terms_have_their_place_in_every_phase() -> None:
    """A residual follows a synergy; phases without the term say so, and phases that do not decide keep."""
    slow, fast = SynergyConfig(decision_interval=100), ResidualConfig(decision_interval=2)
    both, alone, neither = (
        ActionConfig(synergy=slow, residual=fast), ActionConfig(residual=fast), ActionConfig(residual=None)
    )  # fmt: skip
    phases = [PhaseConfig(str(row), 200, action=action) for row, action in enumerate((both, alone, neither, both))]
    phases[3] = replace(phases[3], decides=False)
    columns, intervals = action_columns.term_columns(phases, "synergy")
    assert columns == [[*range(12), -1, -1], [-1] * 14, [-1] * 14, [*range(12), -1, -1]]
    assert intervals == [100, -1, -1, 0]
    columns, intervals = action_columns.term_columns(phases, "residual")
    assert columns == [[*range(first, first + 51)] for first in (12, 0, 0, 12)]
    assert intervals == [2, 2, -1, 0]
