"""The recompiled MuJoCo model is Newton's, plus sensors."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from artigrasp.assets.object import load_object, read_object
from artigrasp.config import StageConfig
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT
from artigrasp.simulation.mujoco_model import compile_mujoco, model_layout
from artigrasp.simulation.scene import HAND_BASE, build_newton_model, make_newton_solver
from tests.simulation.scenes import open_scene

EXACT_FIELDS = (
    "body_parentid",
    "body_gravcomp",
    "jnt_type",
    "jnt_bodyid",
    "jnt_limited",
    "dof_parentid",
    "geom_type",
    "geom_bodyid",
    "geom_contype",
    "geom_conaffinity",
    "geom_condim",
    "exclude_signature",
)
CLOSE_FIELDS = (
    "body_pos",
    "body_quat",
    "body_mass",
    "jnt_axis",
    "jnt_pos",
    "jnt_solref",
    "jnt_solimp",
    "dof_armature",
    "dof_damping",
    "dof_frictionloss",
    "geom_pos",
    "geom_friction",
    "geom_solref",
    "geom_solimp",
    "geom_margin",
    "geom_gap",
)
OPTIONS = ("gravity", "impratio", "cone", "solver", "integrator", "iterations", "ls_iterations")


@pytest.mark.parametrize("fixed_base", [True, False])
@pytest.mark.parametrize("sides", [("right",), ("left", "right")])
def test_equal_to_newtons_model_field_by_field(fixed_base: bool, sides: tuple[str, ...]) -> None:
    """Everything but the timestep, the storage of matrices and the sensors survives the way through MJCF."""
    scene = open_scene(fixed_base, sides)
    newtons = make_newton_solver(scene, build_newton_model(scene), use_mujoco_cpu=True).mj_model
    ours = compile_mujoco(scene)
    for name in EXACT_FIELDS:
        np.testing.assert_array_equal(getattr(ours, name), getattr(newtons, name), err_msg=name)
    for name in CLOSE_FIELDS:
        np.testing.assert_allclose(getattr(ours, name), getattr(newtons, name), rtol=1e-4, atol=1e-6, err_msg=name)
    # the third size of a capsule means nothing, and MJCF drops it
    capsule = newtons.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE
    np.testing.assert_allclose(ours.geom_size[~capsule], newtons.geom_size[~capsule], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(ours.geom_size[capsule, :2], newtons.geom_size[capsule, :2], rtol=1e-4)
    # MJCF writes inertia frames that may order the principal axes anew
    np.testing.assert_allclose(
        np.sort(ours.body_inertia, axis=1), np.sort(newtons.body_inertia, axis=1), rtol=1e-3, atol=1e-9
    )
    for name in OPTIONS:
        np.testing.assert_allclose(getattr(ours.opt, name), getattr(newtons.opt, name), rtol=1e-6, err_msg=name)
    assert ours.opt.timestep == scene.physics.timestep
    assert ours.opt.jacobian == mujoco.mjtJacobian.mjJAC_SPARSE
    assert ours.nsensor == 2 * LINK_COUNT * len(sides)


def test_contact_settings_are_the_configs() -> None:
    """Friction, solref, solimp and gap of every geom are those of the config."""
    scene = open_scene(True)
    model, physics = compile_mujoco(scene), scene.physics
    assert (model.geom_friction[:, 0] == physics.friction).all()
    np.testing.assert_allclose(model.geom_solref, np.tile(physics.solref, (model.ngeom, 1)), rtol=1e-6)
    np.testing.assert_allclose(model.geom_solimp[:, :3], np.tile(physics.solimp, (model.ngeom, 1)), rtol=1e-6)
    assert (model.geom_gap == 0).all() and (model.geom_margin == 0).all()


def test_joint_dynamics_are_the_hands() -> None:
    """Damping and armature reach every coordinate, the wrist's slides and hinges alike, which share one USD joint."""
    scene = open_scene(True)
    model = compile_mujoco(scene)
    dof = model_layout(model, scene).hand_dof[0]
    np.testing.assert_allclose(model.dof_damping[dof], scene.hands[0].damping)
    np.testing.assert_allclose(model.dof_armature[dof], scene.hands[0].armature)
    assert model.dof_damping[dof[:6]].tolist() == [10.0, 10.0, 10.0, 1.0, 1.0, 1.0]


def test_only_the_hinge_has_limits() -> None:
    """Hand joints turn freely, for targets are clipped instead; the hinge stops at the asset's limits."""
    scene = open_scene(False)
    model = compile_mujoco(scene)
    layout = model_layout(model, scene)
    hinge = model.joint("object0_hinge")
    assert model.jnt_limited.nonzero()[0].tolist() == [hinge.id]
    assert layout.hinge_dof[0] == model.jnt_dofadr[hinge.id]
    np.testing.assert_allclose(hinge.range, [scene.objects[0].hinge_lower, scene.objects[0].hinge_upper], atol=1e-5)


@pytest.mark.parametrize("fixed_base", [True, False])
def test_bases_are_mocap_bodies(fixed_base: bool) -> None:
    """Hand bases always move by mocap, the object's base only where it is fixed."""
    scene = open_scene(fixed_base, ("left", "right"))
    model = compile_mujoco(scene)
    layout = model_layout(model, scene)
    assert sorted(layout.hand_mocap) == [0, 1]
    assert (layout.object_mocap[0] >= 0) == fixed_base
    assert (layout.object_qpos[0] >= 0) == (not fixed_base)
    assert model.nv == 2 * DOF_COUNT + 1 + (0 if fixed_base else 6)
    assert model.body_gravcomp[model.body(f"left_{HAND_BASE}").id] == 1.0


@pytest.mark.parametrize(("name", "count"), [("lidded-box", 2), ("open-scissors", 4)])
def test_who_collides_with_whom(name: str, count: int) -> None:
    """Objects with all but their own parts; hands with objects and each other, but not with what objects stand on.

    However many pieces there are: Newton's own masks give up on many.
    """
    stage = StageConfig(height=0.01, size=(0.5, 0.5))
    scene = replace(open_scene(False, ("left", "right")), objects=(load_object(name),) * count, stage=stage)
    model = compile_mujoco(scene)
    data = mujoco.MjData(model)
    # everything in one heap around the origin, sunk into stage and table
    data.qpos[model_layout(model, scene).object_qpos + 2] = -0.005
    mujoco.mj_forward(model, data)
    owner = [
        (model.body(body) if body else model.geom(geom)).name.split("_")[0]
        for geom, body in enumerate(model.geom_bodyid)
    ]
    pairs = {frozenset((owner[contact.geom1], owner[contact.geom2])) for contact in data.contact}
    hands, objects = ("left", "right"), [f"object{slot}" for slot in range(count)]
    expected = {hands, *itertools.combinations(objects, 2), *itertools.product(objects, (*hands, "table", "stage"))}
    assert pairs == {frozenset(pair) for pair in expected}


def test_parts_of_a_closed_object_do_not_push_each_other() -> None:
    """Base and lid touch at rest but make no contact, though MuJoCo lets a mocap body collide with its child."""
    scene = open_scene(True)
    model = compile_mujoco(scene)
    data = mujoco.MjData(model)
    for mocap in model_layout(model, scene).hand_mocap:
        data.mocap_pos[mocap] = [5.0, 5.0, 5.0]
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_an_inertia_that_no_body_has_is_the_users_mistake(tmp_path: Path) -> None:
    """MuJoCo's complaint, with the files that it may be about."""
    scene = open_scene(fixed_base=True)
    (box,) = scene.objects
    text = box.path.read_text()
    damaged = re.sub(r"diagonalInertia = \([^)]*\)", "diagonalInertia = (3, 0.006397694, 0.008308102)", text, count=1)
    (tmp_path / "box.usda").write_text(damaged)
    with pytest.raises(UserError, match=r"box.usda: cannot be simulated: .*; artigrasp check-asset says more"):
        compile_mujoco(replace(scene, objects=(read_object(tmp_path / "box.usda"),)))
