"""Assets and settings as the kernels read them."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import ActionConfig, PDGain, PDGains, ResetConfig, ResidualConfig, RewardConfig, SynergyConfig
from artigrasp.environment import tables
from artigrasp.environment.worlds import training_worlds
from artigrasp.kernels import actions
from tests.example_references import box_references


def test_hands_keep_their_order() -> None:
    """Row 0 is the first hand of the scene."""
    hands = [load_hand("open", side) for side in ("left", "right")]
    table = tables.hand_table(hands, "cpu")
    for name in ("link_offset", "tip_offset", "lower", "upper"):
        expected = np.stack([getattr(hand, name) for hand in hands])
        np.testing.assert_allclose(getattr(table, name).numpy(), expected, atol=1e-6)


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
    settings = tables.action_settings(both, ResetConfig(open_fraction=0.25))
    assert (settings.wrist_prior, settings.finger_prior) == (actions.WRIST_HINGE, actions.FINGERS_REFERENCE)
    assert settings.open_fraction == 0.25
    assert settings.lead_scale > 0.0 and min(settings.residual_scale) > 0.0
    neither = tables.action_settings(replace(both, synergy=None, residual=None), ResetConfig())
    scales = ("wrist_translation_scale", "wrist_rotation_scale", "lead_scale")
    assert all(getattr(neither, name) == 0.0 for name in scales) and max(neither.residual_scale) == 0.0


def test_rewards_are_the_tasks() -> None:
    """One weight serves both velocities of the wrist; outcomes are left out where none counts."""
    weights = tables.reward_weights(RewardConfig(hand_velocity=0.7, angle=2.0))
    assert weights.hand_linear_velocity == weights.hand_angular_velocity == pytest.approx(0.7)
    assert weights.angle == pytest.approx(2.0)
    assert tables.outcome_weights(RewardConfig()) is None
    assert list(tables.outcome_weights(RewardConfig(outcome_success=0.5))) == [0.0, 0.0, 0.5]


def test_gains_are_per_group_and_hand() -> None:
    """Three groups of joints, the same in every world and hand until somebody changes them."""
    gains = PDGains(PDGain(1.0, 2.0), PDGain(3.0, 4.0), PDGain(5.0, 6.0))
    stiffness, damping = tables.gain_tables(gains, 4, 2, "cpu")
    np.testing.assert_array_equal(stiffness.numpy(), np.broadcast_to([1.0, 3.0, 5.0], (4, 2, 3)))
    np.testing.assert_array_equal(damping.numpy(), np.broadcast_to([2.0, 4.0, 6.0], (4, 2, 3)))
