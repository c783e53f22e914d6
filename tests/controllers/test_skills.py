"""Controllers in the phases that they have learned."""

from dataclasses import replace

from artigrasp.config import ResidualConfig, SynergyConfig
from artigrasp.controllers.controller import ZeroController, pd_ik_controller
from artigrasp.controllers.search import with_offsets
from artigrasp.controllers.skills import in_free_scene, with_skills
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import GRASP, GRASP_THEN_ARTICULATE, GRASPING, RELOCATE

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
    """With both hands and its own action; one that has a free base stays as it is, and neither is changed."""
    fixed = pd_ik_controller(get_task("right-fixed"))
    moved = in_free_scene(fixed)
    assert moved.task == replace(fixed.task, hands=("left", "right"), fixed_base=False)
    assert fixed.task.fixed_base and moved.name == "pd-ik"
    free = pd_ik_controller(BOTH)
    assert in_free_scene(free) is free
