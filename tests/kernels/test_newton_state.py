"""Newton's flat arrays: round trips, and Newton's own kinematics as the independent reference."""

import newton
import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.kernels import newton_state, states
from artigrasp.kernels.layout import DOF_COUNT, LINK_COUNT, PARTS
from tests.kernels.samples import Sample, fill, object_slots, random_sample

WORLD_COUNT, HAND_COUNT, OBJECT_COUNT = 4, 2, 2
CENTRE_OF_MASS = (0.3, 0.2, -0.1)


def newton_model() -> newton.Model:
    """Worlds of free bodies whose centres of mass are away from their frames, each with a lid on a hinge."""
    builder = newton.ModelBuilder()
    inertia = wp.mat33(*np.diag([0.01, 0.02, 0.03]).ravel())
    for _ in range(OBJECT_COUNT):
        base = builder.add_link(mass=1.0, com=wp.vec3(*CENTRE_OF_MASS), inertia=inertia)
        lid = builder.add_link(mass=0.1, inertia=inertia)
        joints = [builder.add_joint_free(base), builder.add_joint_revolute(base, lid, axis=newton.Axis.X)]
        builder.add_articulation(joints)
    worlds = newton.ModelBuilder()
    worlds.replicate(builder, WORLD_COUNT)
    return worlds.finalize(device="cpu")


def object_layout(free: bool) -> newton_state.NewtonLayout:
    """Places of these objects, without hands."""
    layout = newton_state.NewtonLayout()
    slots = np.arange(OBJECT_COUNT)
    layout.world_coords, layout.world_dofs = 8 * OBJECT_COUNT, 7 * OBJECT_COUNT
    layout.world_joints = layout.world_bodies = 2 * OBJECT_COUNT
    layout.hand_coord = layout.hand_dof = wp.zeros((0, DOF_COUNT), dtype=int)
    layout.hand_base_joint = wp.zeros(0, dtype=int)
    layout.hinge_coord, layout.hinge_dof = wp.array(8 * slots + 7, dtype=int), wp.array(7 * slots + 6, dtype=int)
    no_base = np.full(OBJECT_COUNT, newton_state.NO_FREE_BASE)
    layout.object_coord = wp.array(8 * slots if free else no_base, dtype=int)
    layout.object_dof = wp.array(7 * slots if free else no_base, dtype=int)
    layout.object_base_joint = layout.object_base_body = wp.array(2 * slots, dtype=int)
    return layout


def pack(
    model: newton.Model, layout: newton_state.NewtonLayout, sample: Sample, mask: np.ndarray
) -> tuple[newton.State, np.ndarray]:
    """Newton's state with the masked worlds of the sample in it, and the flags of the worlds written."""
    state, written = model.state(), wp.zeros(WORLD_COUNT + 1, dtype=wp.bool)
    hands = fill(states.hand_state(*sample.joint_q.shape[:2]), states.HandState, sample)
    wp.launch(
        newton_state.pack_state,
        WORLD_COUNT,
        inputs=[wp.array(mask, dtype=int), hands, object_slots(sample, OBJECT_COUNT), model.body_com, layout],
        outputs=[state.joint_q, state.joint_qd, model.joint_X_p, written],
    )
    return state, written.numpy()


def unpack(model: newton.Model, layout: newton_state.NewtonLayout, state: newton.State) -> states.ObjectSlots:
    """Newton's state as ours."""
    slots = states.object_slots(WORLD_COUNT, OBJECT_COUNT)
    inputs = [state.joint_q, state.joint_qd, model.body_com, layout]
    wp.launch(newton_state.unpack_objects, slots.pose.shape, inputs=inputs, outputs=[slots])
    return slots


def test_a_free_base_moves_as_newton_says() -> None:
    """What was packed is the pose of Newton's bodies and the velocity of their centres of mass, and comes back."""
    model, sample = newton_model(), random_sample(WORLD_COUNT)
    layout, expected = object_layout(free=True), object_slots(sample, OBJECT_COUNT)
    state, _ = pack(model, layout, sample, np.ones(WORLD_COUNT, int))
    newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    # every other body is a base
    pose, velocity = (
        array.numpy()[::2].reshape(WORLD_COUNT, OBJECT_COUNT, -1) for array in (state.body_q, state.body_qd)
    )
    wanted = expected.pose.numpy()
    np.testing.assert_allclose(pose[..., :3], wanted[..., :3], atol=1e-6)
    np.testing.assert_allclose(np.abs((pose[..., 3:] * wanted[..., 3:]).sum(-1)), 1.0, atol=1e-6)
    linear, angular = np.split(expected.velocity.numpy(), 2, axis=-1)
    rotated = Rotation.from_quat(wanted[..., 3:].reshape(-1, 4)).apply(CENTRE_OF_MASS).reshape(linear.shape)
    np.testing.assert_allclose(velocity[..., :3], linear + np.cross(angular, rotated), atol=1e-5)
    np.testing.assert_allclose(velocity[..., 3:], angular, atol=1e-5)
    slots = unpack(model, layout, state)
    for name in states.element_types(states.ObjectSlots):
        found = getattr(slots, name).numpy()
        np.testing.assert_allclose(found, getattr(expected, name).numpy(), atol=1e-5, err_msg=name)


def test_a_fixed_base_is_the_frame_of_its_joint() -> None:
    """A fixed base moves the joint that holds it, in the masked worlds only, and no coordinates but the hinge's."""
    model, sample = newton_model(), random_sample(WORLD_COUNT)
    mask = np.array([True, False, False, True])
    slots = object_slots(sample, OBJECT_COUNT)
    expected = model.joint_X_p.numpy().reshape(WORLD_COUNT, 2 * OBJECT_COUNT, 7).copy()
    expected[mask, ::2] = slots.pose.numpy()[mask]
    state, written = pack(model, object_layout(free=False), sample, mask)
    assert written.tolist() == [True, False, False, True, False]
    np.testing.assert_array_equal(model.joint_X_p.numpy().reshape(expected.shape), expected)
    expected = model.joint_q.numpy().reshape(WORLD_COUNT, OBJECT_COUNT, 8).copy()
    expected[mask, :, 7] = slots.hinge_q.numpy()[mask]
    np.testing.assert_array_equal(state.joint_q.numpy().reshape(expected.shape), expected)


@pytest.mark.parametrize("link_first", [True, False])
def test_contact_forces_act_on_the_link(link_first: bool) -> None:
    """Whichever shape comes first; contacts without a link, a part or the focus, and leftovers, do not count."""
    layout = newton_state.NewtonLayout()
    link, part = 1 * LINK_COUNT + 3, 1
    # shapes: a link, a part, a link of the other hand, the table, and the same part of another object; all of world 2
    layout.shape_world = wp.full(5, 2, dtype=int)
    layout.shape_link = wp.array([link, -1, 5, -1, -1], dtype=int)
    layout.shape_part = wp.array([-1, 2 * len(PARTS) + part, -1, -1, part], dtype=int)
    pairs = np.array([[0, 1], [0, 1], [0, 2], [1, 3], [0, 3], [0, 4], [0, 1]])
    forces = np.arange(42, dtype=np.float32).reshape(7, 6)
    if not link_first:
        pairs, forces = pairs[:, ::-1], -forces
    hands = states.hand_state(WORLD_COUNT, HAND_COUNT)
    wp.launch(
        newton_state.accumulate_contact_force,
        len(pairs),
        inputs=[
            wp.array([6], dtype=int),
            wp.array(pairs[:, 0].copy(), dtype=int),
            wp.array(pairs[:, 1].copy(), dtype=int),
            wp.array(forces, dtype=wp.spatial_vector),
            layout,
            wp.array([0, 1, 2, 0], dtype=int),
            0.25,
        ],
        outputs=[hands],
    )
    expected = np.zeros((WORLD_COUNT, HAND_COUNT, LINK_COUNT, len(PARTS), 3))
    expected[2, 1, 3, part] = 0.25 * np.abs(forces[:2, :3]).sum(axis=0)
    np.testing.assert_array_equal(hands.contact_force.numpy(), expected)


def test_worlds_that_are_not_finite_have_failed() -> None:
    """Not a number and far too large both mark a world; overflows of the bits asked for are counted."""
    layout = newton_state.NewtonLayout()
    layout.world_coords, layout.world_dofs = 3, 2
    joint_q, joint_qd = np.zeros((WORLD_COUNT, 3)), np.zeros((WORLD_COUNT, 2))
    joint_q[1, 2], joint_qd[2, 0] = np.nan, -1e11
    failed = wp.full(WORLD_COUNT + 1, True, dtype=wp.bool)
    diverged = wp.array([1, 0, 0, 0], dtype=int)
    overflow_count = wp.array([0, 0, 5, 5], dtype=int)
    wp.launch(
        newton_state.check_worlds,
        WORLD_COUNT,
        inputs=[
            wp.array(joint_q.ravel(), dtype=float),
            wp.array(joint_qd.ravel(), dtype=float),
            wp.array([0, 4, 2, 6], dtype=int),
            2,
            layout,
        ],
        outputs=[failed, diverged, overflow_count],
    )
    assert failed.numpy()[:WORLD_COUNT].tolist() == [False, True, True, False]
    assert diverged.numpy().tolist() == [1, 1, 1, 0]
    assert overflow_count.numpy().tolist() == [0, 0, 6, 6]
