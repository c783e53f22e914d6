"""Controllers in the phases that they have learned."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.config import ResidualConfig, SynergyConfig, TaskConfig
from artigrasp.controllers.controller import PolicyController, ZeroController, pd_ik_controller
from artigrasp.controllers.search import with_offsets
from artigrasp.controllers.skills import Team, in_free_scene, in_scene, with_skills
from artigrasp.environment.action_columns import action_count, synergy_directions, term_columns
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT, FEATURE_COUNT
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import GRASP, GRASP_THEN_ARTICULATE, GRASPING, RELOCATE
from tests.controllers.examples import example_policy

BOTH = get_task("both-free")


def test_pd_ik_plays_the_sequence_as_it_is() -> None:
    """It decides nothing."""
    assert with_skills(GRASPING, pd_ik_controller(BOTH)) == GRASPING


def test_a_search_around_pd_ik_adds_offsets_to_every_phase_of_a_skill() -> None:
    """Priors and gains stay; what was decided while grasping holds on while carrying."""
    controller = ZeroController(with_offsets(pd_ik_controller(BOTH).task))
    grasp, relocate, hold = with_skills(GRASPING, controller)
    synergy = controller.task.action.synergy
    assert grasp == replace(GRASP, action=replace(GRASP.action, synergy=synergy))
    assert relocate == replace(RELOCATE, decides=False, action=replace(RELOCATE.action, synergy=synergy))
    assert not hold.decides


def test_a_policy_brings_its_priors_where_it_has_the_skill() -> None:
    """One for articulation leaves grasping to PD+IK; a fast one goes on deciding while the object is carried."""
    task = replace(BOTH, kinds=("articulate",), action=replace(BOTH.action, synergy=SynergyConfig()))
    phases = with_skills(GRASP_THEN_ARTICULATE, ZeroController(task))
    assert phases[:-1] == GRASP_THEN_ARTICULATE[:-1]
    assert phases[-1] == replace(GRASP_THEN_ARTICULATE[-1], action=task.action, gains=task.gains)
    fast = ZeroController(replace(BOTH, kinds=("grasp",)))
    grasp, relocate, _ = with_skills(GRASPING, fast)
    assert grasp.action == BOTH.action and grasp.gains == BOTH.gains
    assert relocate.action == replace(RELOCATE.action, residual=ResidualConfig()) and relocate.decides
    assert relocate.gains == RELOCATE.gains


def test_a_controller_of_a_fixed_base_moves_to_a_scene_with_a_free_one() -> None:
    """With both hands and its own action, and back; one that is there stays as it is, and none is changed."""
    fixed = pd_ik_controller(get_task("right-fixed"))
    moved = in_free_scene(fixed)
    assert moved.task == replace(fixed.task, hands=("left", "right"), fixed_base=False)
    assert fixed.task.fixed_base and moved.name == "pd-ik"
    free = pd_ik_controller(BOTH)
    assert in_free_scene(free) is free
    back = in_scene(free, get_task("right-fixed")).task
    assert back.hands == ("right",) and back.fixed_base and back.action == free.task.action


def team(articulate: TaskConfig, grasp: TaskConfig) -> Team:
    """Two untrained policies."""
    return Team(
        {
            "articulate": PolicyController(example_policy(articulate)),
            "grasp": PolicyController(example_policy(grasp, seed=4)),
        }
    )


def test_two_policies_act_each_in_its_phases() -> None:
    """Each brings its action; in that of both, side by side, every phase finds the columns of its own."""
    opening = replace(BOTH, kinds=("articulate",), action=replace(BOTH.action, synergy=SynergyConfig()))
    grasping = replace(BOTH, kinds=("grasp",))
    both = team(opening, grasping)
    grasp, relocate, put_down, *between, articulate = with_skills(GRASP_THEN_ARTICULATE, both)
    assert grasp.action == grasping.action and articulate.action == opening.action
    assert tuple(between) == GRASP_THEN_ARTICULATE[3:-1]
    count = action_count(opening.action)
    assert [each.first_column for each in (grasp, relocate, put_down, articulate)] == [count, count, count, 0]
    features = np.random.default_rng(0).normal(size=(3, 2, FEATURE_COUNT)).astype(np.float32)
    apart = [member.act(features) for member in both.members.values()]
    np.testing.assert_array_equal(both.act(features), np.concatenate(apart, axis=-1))
    columns, _ = term_columns([articulate, grasp], "residual")
    first = len(synergy_directions(opening.action.synergy))
    assert columns[0] == list(range(first, count)) and columns[1] == list(range(count, count + DOF_COUNT))


def test_a_team_is_of_one_world() -> None:
    """Both have learned what they should do, in the same physics and seeing the same."""
    grasping = replace(BOTH, kinds=("grasp",))
    with pytest.raises(UserError, match="expected one that learned to articulate, found one for grasp"):
        team(grasping, grasping)
    opening = replace(BOTH, kinds=("articulate",))
    with pytest.raises(UserError, match="same include_hinge_features, found True and False"):
        team(opening, replace(grasping, include_hinge_features=False))
    with pytest.raises(UserError, match="same physics"):
        team(opening, replace(grasping, physics=replace(grasping.physics, friction=0.5)))
