"""One scene definition for every backend: hands, hinged objects and what they stand on, as a Newton model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from artigrasp.assets.hand import HandModel
from artigrasp.config import PhysicsConfig, StageConfig
from artigrasp.kernels.layout import DOFS, LINKS, PARTS

if TYPE_CHECKING:
    from artigrasp.assets.object import ObjectModel

HAND_BASE = "base"
"""Body that carries the wrist joint; it is fixed to the world and becomes MuJoCo's mocap body."""

TABLE, STAGE = "table", "stage"
_HAND_COLLISION_GROUP = {"left": -2, "right": -1}
"""In Newton a negative group collides with every group but itself."""
_FIRST_OBJECT_COLLISION_GROUP = -3
"""The next objects take the next numbers downwards."""
_SUPPORT_COLLISION_GROUP = 1
_HEIGHT_AT_FIRST = 10.0
"""Of an object over the table or the object before it until poses are written [m]: solvers size themselves by the first
contacts, which mean nothing."""
_MASK_DOMAIN = 0
"""Whose bits collision masks are; Newton keeps those of one domain as they are."""
_UNLIMITED = 1e10
"""Joint limit from which on Newton makes no constraint of it."""
_LIMIT_SOLREF = (0.02, 1.0)
"""Time constant [s] and damping ratio of the hinge's stop: MuJoCo's defaults."""
_RAW_SOLREF = 1
"""Newton's mode in which it takes the stop's solref as given; its own gains would be lost on the way through MJCF."""


@dataclass(frozen=True)
class Scene:
    """What stands in one world: one or two hands, objects, the table plane z = 0, and a stage if there is one.

    Everything collides with everything else, but hands do not with table and stage, as in the authors' release, and
    nothing does with itself.
    """

    hands: tuple[HandModel, ...]
    """One hand, or the left and the right one."""
    objects: tuple[ObjectModel, ...]
    """The hinged objects; an index of this tuple is a *slot* of the simulation's state."""
    fixed_base: bool
    """Whether the bases of all objects stay where they are put."""
    physics: PhysicsConfig
    stage: StageConfig | None = None

    @property
    def has_flat_contacts(self) -> bool:
        """Whether faces may lie on faces, which takes more than one contact for each pair of convex pieces.

        With one contact, an object on a stage rocks by up to 8 mm; with several it rests as still as on the table,
        whose plane makes as many contacts as it needs in any case.
        """
        return self.stage is not None or len(self.objects) > 1


def object_label(slot: int) -> str:
    """What the names of an object's bodies and joints begin with."""
    return f"object{slot}"


def check_alike(scenes: Sequence[Scene]) -> None:
    """Worlds that are stepped together may differ in which objects they hold, not in how many, nor in anything else.

    Raises:
        ValueError: They differ in more.
    """
    kinds = {
        (tuple(hand.path for hand in each.hands), len(each.objects), each.fixed_base, each.physics, each.stage)
        for each in scenes
    }
    if len(kinds) != 1:
        raise ValueError("scenes: expected them to differ in nothing but their objects, and not in how many these are")


def build_newton_model(scene: Scene) -> newton.Model:
    """One copy of the scene as a Newton model on the CPU device, outside of any world."""
    model = _scene_builder(scene).finalize(device="cpu")
    _set_mujoco_attributes(model, scene.physics)
    return model


def build_newton_worlds(
    scenes: Sequence[Scene], world_counts: Sequence[int], device: str, *, requires_grad: bool = False
) -> newton.Model:
    """Copies of every scene, world after world, in one Newton model.

    Args:
        scenes: Scenes that differ in nothing but their objects.
        world_counts: Worlds of each scene.
        device: Where the model's arrays are.
        requires_grad: Whether to simulate it differentiably.
    """
    worlds = newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(worlds)
    for scene, count in zip(scenes, world_counts, strict=True):
        worlds.replicate(_scene_builder(scene), count)
    model = worlds.finalize(device=device, requires_grad=requires_grad)
    _set_mujoco_attributes(model, scenes[0].physics)
    return model


def _scene_builder(scene: Scene) -> newton.ModelBuilder:
    """Import the scene's USD assets.

    Bodies are labelled ``<side>/<link>`` and ``object<slot>/<part>``. Gravity points along -z, the hands are
    gravity-compensated.
    """
    builder = newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(builder)
    # Newton's default of 0.1 m makes every geom a contact candidate: hundreds of contacts per world
    builder.rigid_gap = 0.0
    supports = [builder.add_ground_plane(label=TABLE)]
    if scene.stage is not None:
        supports.append(_add_stage(builder, scene.stage))
    for hand in scene.hands:
        for shape in _add_asset(builder, hand.path, hand.side, (HAND_BASE, *LINKS)):
            builder.shape_collision_group[shape] = _HAND_COLLISION_GROUP[hand.side]
            for support in supports:
                builder.add_shape_collision_filter_pair(support, shape)
        _set_joint_dynamics(builder, hand)
    for slot, each in enumerate(scene.objects):
        height = (slot + 1) * _HEIGHT_AT_FIRST
        for shape in _add_asset(builder, each.path, object_label(slot), PARTS, not scene.fixed_base, height):
            builder.shape_collision_group[shape] = _FIRST_OBJECT_COLLISION_GROUP - slot
    for support in supports:
        builder.shape_collision_group[support] = _SUPPORT_COLLISION_GROUP
    _set_contact_material(builder, scene.physics)
    return builder


def make_newton_solver(scene: Scene, model: newton.Model, **options: object) -> SolverMuJoCo:
    """Newton's MuJoCo solver with the scene's solver settings; ``options`` choose CPU or GPU and capacities."""
    physics = scene.physics
    return SolverMuJoCo(
        model,
        iterations=physics.iterations,
        ls_iterations=physics.ls_iterations,
        cone=physics.cone,
        impratio=physics.impratio,
        integrator="implicitfast",
        solver="newton",
        enable_multiccd=scene.has_flat_contacts,
        # nothing becomes kinematic later, so no root needs a weld in waiting
        kinematic_switchable_roots=False,
        **options,
    )


def joint_and_axis(dof: str) -> tuple[str, int]:
    """The joint that a hand coordinate of ``DOFS`` belongs to, and its place among the coordinates of that joint."""
    link = dof.rsplit("_", 1)[0]
    return f"{link}_joint", [each for each in DOFS if each.startswith(f"{link}_")].index(dof)


def _add_stage(builder: newton.ModelBuilder, stage: StageConfig) -> int:
    """The stage as a box that does not move; its shape."""
    centre = wp.transform((*stage.position, 0.5 * stage.height), wp.quat_identity())
    half = (0.5 * stage.size[0], 0.5 * stage.size[1], 0.5 * stage.height)
    return int(builder.add_shape_box(-1, xform=centre, hx=half[0], hy=half[1], hz=half[2], label=STAGE))


def _add_asset(
    builder: newton.ModelBuilder,
    path: object,
    prefix: str,
    bodies: tuple[str, ...],
    floating: bool | None = None,
    height: float = 0.0,
) -> range:
    """Import a USD file at a height [m], label its bodies and joints ``<prefix>/<name>``; the shapes that it added."""
    first_body, first_joint, first_shape = builder.body_count, builder.joint_count, builder.shape_count
    builder.add_usd(
        str(path),
        xform=wp.transform((0.0, 0.0, height), wp.quat_identity()),
        floating=floating,
        enable_self_collisions=False,
        load_visual_shapes=False,
    )
    for labels, first in ((builder.body_label, first_body), (builder.joint_label, first_joint)):
        for index in range(first, len(labels)):
            labels[index] = f"{prefix}/{labels[index].rsplit('/', 1)[-1]}"
    found = [label.split("/", 1)[1] for label in builder.body_label[first_body:]]
    if sorted(found) != sorted(bodies):
        raise ValueError(f"{path}: expected the bodies {bodies}, the importer made {found}")
    return range(first_shape, builder.shape_count)


def _set_joint_dynamics(builder: newton.ModelBuilder, hand: HandModel) -> None:
    """Passive damping, armature and effort limit of every hand coordinate; the joint limits are lifted.

    USD carries one value per joint; the wrist's slides and hinges share a joint but not their values. PD targets are
    clipped to the effective limits of each world instead of limiting the joint, which lets one model serve references
    that exceed the asset's limits.
    """
    for dof, name in enumerate(DOFS):
        joint, axis = joint_and_axis(name)
        coordinate = builder.joint_qd_start[builder.joint_label.index(f"{hand.side}/{joint}")] + axis
        builder.joint_damping[coordinate] = float(hand.damping[dof])
        builder.joint_armature[coordinate] = float(hand.armature[dof])
        builder.joint_effort_limit[coordinate] = float(hand.effort[dof])
        builder.joint_limit_lower[coordinate] = -_UNLIMITED
        builder.joint_limit_upper[coordinate] = _UNLIMITED


def _set_contact_material(builder: newton.ModelBuilder, physics: PhysicsConfig) -> None:
    time_constant, damping_ratio = physics.solref
    for shape in range(builder.shape_count):
        builder.shape_material_mu[shape] = physics.friction
        # Newton turns (ke, kd) back into MuJoCo's (time constant, damping ratio)
        builder.shape_material_ke[shape] = 1.0 / (time_constant * damping_ratio) ** 2
        builder.shape_material_kd[shape] = 2.0 / time_constant
        builder.shape_gap[shape] = 0.0
        builder.shape_margin[shape] = 0.0


def _set_mujoco_attributes(model: newton.Model, physics: PhysicsConfig) -> None:
    solimp = model.mujoco.geom_solimp.numpy()
    solimp[:, :3] = physics.solimp
    model.mujoco.geom_solimp.assign(solimp)
    model.mujoco.solreflimit.fill_(wp.vec2(*_LIMIT_SOLREF))
    model.mujoco.solreflimit_mode.fill_(_RAW_SOLREF)
    is_hand = np.array([label.split("/")[-2] in _HAND_COLLISION_GROUP for label in model.body_label])
    model.mujoco.gravcomp.assign((is_hand & physics.gravity_compensation).astype(np.float32))
    _set_collision_masks(model)


def _set_collision_masks(model: newton.Model) -> None:
    """Give MuJoCo the collision groups as masks, a bit for each group.

    Newton's own masks are not exact for objects of many pieces: they let a hand collide with the table.
    """
    groups = model.shape_collision_group.numpy().astype(np.int64)
    own = np.int64(1) << (groups.max() - groups)
    everyone, supports = np.bitwise_or.reduce(own), own[groups == _SUPPORT_COLLISION_GROUP][0]
    hands = np.bitwise_or.reduce(own[np.isin(groups, list(_HAND_COLLISION_GROUP.values()))])
    affinity = everyone & ~own
    affinity[own & hands != 0] &= ~supports
    affinity[own == supports] &= ~hands
    model.mujoco.contype.assign(own)
    model.mujoco.conaffinity.assign(affinity)
    model.mujoco.collision_mask_domain.fill_(_MASK_DOMAIN)
