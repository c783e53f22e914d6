"""The Newton backend: MuJoCo Warp on a GPU, or on the CPU device to hold it against the CPU backend.

What runs on a CUDA device has not been tried yet; only the CPU device has been tested. There the two backends agree
but for rounding, with one known difference: where two boxes touch, as palms do, MuJoCo makes up to eight contacts and
MuJoCo Warp fewer.
"""

import contextlib
from collections.abc import Iterator, Sequence

import mujoco_warp
import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from artigrasp.errors import UserError
from artigrasp.kernels import newton_joints, newton_state
from artigrasp.kernels.layout import DOF_COUNT, DOFS, LINKS, PARTS
from artigrasp.simulation.launches import OnWorlds, launch_nothing
from artigrasp.simulation.scene import (
    HAND_BASE,
    Scene,
    build_newton_worlds,
    check_alike,
    joint_and_axis,
    make_newton_solver,
    object_label,
)
from artigrasp.simulation.state import allocate_state

CONTACT_CAPACITY = 128
"""Contacts per world and object for which there is room; all worlds share the room.

Of ARCTIC's objects in two hands, the laptop reaches most: 94, and 283 constraint rows (`tools/measure_capacities.py`,
the whole table is in ``docs/physics.md``). Pairs of shapes that might touch take as much room, and are fewer.
"""

CONSTRAINT_CAPACITY = 400
"""Constraint rows of each world per object: three per contact, limit and friction of the hinge."""

_OVERFLOW = mujoco_warp.OverflowType
_CAPACITY_OVERFLOW = int(
    _OVERFLOW.NEFC
    | _OVERFLOW.NJMAX_NNZ
    | _OVERFLOW.BROADPHASE
    | _OVERFLOW.NARROWPHASE
    | _OVERFLOW.CCD
    | _OVERFLOW.EPA_HORIZON
)


class NewtonSimulation:
    """Worlds of one Newton model, stepped together by MuJoCo Warp.

    With ``capture`` the launches of a control step are recorded in the second call with the same arguments and replayed
    from then on: a CUDA graph on a GPU, a list of kernel calls without Python in between on the CPU.

    Attributes:
        state: The batched state; write into it and call :meth:`write_state` to reset worlds.
        joint_torque: Joint torques [N, N·m] that the next substep applies, float32, shape [world, hand, 51].
        torque_rows: Ranges of worlds that :meth:`step` asks torques for: one, with all of them.
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        world_counts: Sequence[int],
        device: str = "cpu",
        *,
        contact_capacity: int = CONTACT_CAPACITY,
        constraint_capacity: int = CONSTRAINT_CAPACITY,
        capture: bool = True,
    ) -> None:
        """Build the worlds and compile the solver.

        Args:
            scenes: Scenes that differ in nothing but their objects.
            world_counts: Worlds of each scene.
            device: Warp device, such as ``cpu`` or ``cuda:0``.
            contact_capacity: Contacts per world and object, on average over the worlds.
            constraint_capacity: Constraint rows of each world per object.
            capture: Whether to replay control steps as a graph.

        Raises:
            UserError: There is no such device.
            ValueError: The scenes differ in more than their objects, or the capacities are too small for them.
        """
        check_alike(scenes)
        if device not in (known := [each.alias for each in wp.get_devices()]):
            raise UserError(f"device: expected one of {', '.join(known)}, found {device!r}")
        self.device, self.scenes = device, tuple(scenes)
        self.world_count, self.hand_count = sum(world_counts), len(scenes[0].hands)
        self.substeps = scenes[0].physics.substeps
        self.torque_rows = (slice(0, self.world_count),)
        self._timestep = scenes[0].physics.timestep
        self._model = build_newton_worlds(scenes, world_counts, device)
        self._layout = newton_layout(self._model, scenes[0])
        _move_hands_away(self._model, self._layout)
        object_count = len(scenes[0].objects)
        contacts, rows = contact_capacity * object_count, constraint_capacity * object_count
        with wp.ScopedDevice(device):
            self._solver = make_newton_solver(scenes[0], self._model, nconmax=contacts, njmax=rows)
        # it would print; overflows are counted instead
        self._solver.mjw_model.opt.warn_overflow = 0
        allocated = (self._solver.mjw_data.naconmax, self._solver.mjw_data.njmax)
        if allocated != (contacts * self.world_count, rows):
            raise ValueError(f"an object by itself needs room for {allocated[0]} contacts and {allocated[1]} rows")
        self._state, self._control = self._model.state(), self._model.control()
        self._contacts = newton.Contacts(self._solver.get_max_contact_count(), 0, device=device)
        kinds = SolverMuJoCo.ObservableKind
        self._observables = self._solver.observables({kinds.CONTACT_F, kinds.OVERFLOW}, contacts=self._contacts)

        self.state = allocate_state(self.world_count, self.hand_count, object_count, device)
        self.joint_torque = wp.zeros_like(self.state.hands.joint_q)
        # the last entry stands for what belongs to no world
        self._world_flag = wp.zeros(self.world_count + 1, dtype=wp.bool, device=device)
        self._capture = capture
        self._graphs: dict[tuple[OnWorlds, ...], wp.Graph | None] = {}

    def step(
        self, apply_torques: OnWorlds, begin: OnWorlds = launch_nothing, finish: OnWorlds = launch_nothing
    ) -> None:
        """Advance every world by one control step, see :meth:`artigrasp.simulation.backend.Simulation.step`."""
        calls = (apply_torques, begin, finish)
        if not self._capture:
            self._step(*calls)
        elif calls not in self._graphs:
            # kernels must be loaded before they can be recorded, so the first call records nothing
            self._graphs[calls] = None
            self._step(*calls)
        else:
            if (graph := self._graphs[calls]) is None:
                with wp.ScopedCapture(device=self.device) as recording:
                    self._step(*calls)
                self._graphs[calls] = graph = recording.graph
            wp.capture_launch(graph)

    def launch(self, kernels: OnWorlds) -> None:
        """Launch kernels for every world."""
        kernels(*self.torque_rows)

    @contextlib.contextmanager
    def without_replay(self) -> Iterator[None]:
        """While this lasts, every kernel is launched by itself."""
        capture, self._capture = self._capture, False
        try:
            yield
        finally:
            self._capture = capture

    def write_state(self, world_mask: wp.array) -> None:
        """Push ``state`` into the physics for the worlds whose mask (int, shape [world]) is not zero."""
        self.state.write_focus(world_mask)
        self._launch(
            newton_state.pack_state,
            self.world_count,
            [world_mask, self.state.hands, self.state.slots, self._model.body_com, self._layout],
            [self._state.joint_q, self._state.joint_qd, self._model.joint_X_p, self._world_flag],
        )
        # no flags: the joints were just written, only warm starts and applied forces go
        self._solver.reset(self._state, world_mask=self._world_flag, flags=0)

    def pack_torques(self) -> None:
        """Write ``joint_torque`` where the solver takes it from."""
        torque = self.joint_torque
        self._launch(newton_joints.write_torques, torque.shape, [torque, self._layout], [self._control.joint_f])

    def step_solver(self) -> None:
        """All substeps with the torques held, and nothing else: what :meth:`step` is measured by."""
        for _ in range(self.substeps):
            self._solver.step(self._state, self._state, self._control, self._contacts, self._timestep)

    def _step(self, apply_torques: OnWorlds, begin: OnWorlds, finish: OnWorlds) -> None:
        hands = (self.world_count, self.hand_count)
        joint_q, joint_qd = self._state.joint_q, self._state.joint_qd
        begin(*self.torque_rows)
        self.state.hands.contact_force.zero_()
        for _ in range(self.substeps):
            apply_torques(*self.torque_rows)
            self.pack_torques()
            self._solver.step(
                self._state, self._state, self._control, self._contacts, self._timestep, observables=self._observables
            )
            self._accumulate_contact_force()
            self._launch(
                newton_state.check_worlds,
                self.world_count,
                [joint_q, joint_qd, self._observables.overflow, _CAPACITY_OVERFLOW, self._layout],
                [self._world_flag, self.state.diverged, self.state.overflow_count],
            )
            # as MuJoCo does by itself on the CPU, so that no NaN reaches a learner
            self._solver.reset(self._state, world_mask=self._world_flag)
            self._launch(
                newton_state.unpack_hands,
                hands,
                [joint_q, joint_qd, self._world_flag, self._layout],
                [self.state.hands],
            )
        self._launch(
            newton_state.unpack_objects,
            (self.world_count, self.state.object_count),
            [joint_q, joint_qd, self._model.body_com, self._layout],
            [self.state.slots],
        )
        self.state.read_focus()
        finish(*self.torque_rows)

    def _accumulate_contact_force(self) -> None:
        contacts = self._contacts
        self._launch(
            newton_state.accumulate_contact_force,
            contacts.rigid_contact_max,
            [
                contacts.rigid_contact_count,
                contacts.rigid_contact_shape0,
                contacts.rigid_contact_shape1,
                self._observables.contact_f,
                self._layout,
                self.state.focus,
                1.0 / self.substeps,
            ],
            [self.state.hands],
        )

    def _launch(
        self, kernel: wp.Kernel, dim: int | tuple[int, ...], inputs: list[object], outputs: list[object]
    ) -> None:
        wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=self.device)


def newton_layout(model: newton.Model, scene: Scene) -> newton_state.NewtonLayout:
    """Find the scene's quantities in a model's first world; the other worlds follow at the same distance."""
    worlds = model.world_count
    layout = newton_state.NewtonLayout()
    layout.world_coords = model.joint_coord_count // worlds
    layout.world_dofs = model.joint_dof_count // worlds
    layout.world_joints = model.joint_count // worlds
    layout.world_bodies = model.body_count // worlds

    joints = [_short(label) for label in model.joint_label[: layout.world_joints]]
    bodies = [_short(label) for label in model.body_label]
    first_coord, first_dof = model.joint_q_start.numpy(), model.joint_qd_start.numpy()
    child = model.joint_child.numpy()[: layout.world_joints].tolist()

    hand_coord = np.empty((len(scene.hands), DOF_COUNT), dtype=np.int32)
    hand_dof = np.empty_like(hand_coord)
    for row, hand in enumerate(scene.hands):
        for dof, name in enumerate(DOFS):
            name_of_joint, axis = joint_and_axis(name)
            joint = joints.index(f"{hand.side}/{name_of_joint}")
            hand_coord[row, dof], hand_dof[row, dof] = first_coord[joint] + axis, first_dof[joint] + axis
    hand_base = [child.index(bodies.index(f"{hand.side}/{HAND_BASE}")) for hand in scene.hands]
    labels = [object_label(slot) for slot in range(len(scene.objects))]
    hinges = [joints.index(f"{label}/hinge") for label in labels]
    base_bodies = [bodies.index(f"{label}/{PARTS[0]}") for label in labels]
    base_joints = [child.index(body) for body in base_bodies]
    no_base = np.full(len(labels), newton_state.NO_FREE_BASE)

    links = [f"{hand.side}/{link}" for hand in scene.hands for link in LINKS]
    parts = [f"{label}/{part}" for label in labels for part in PARTS]
    owners = [bodies[body] if body >= 0 else "" for body in model.shape_body.numpy()]
    layout.shape_world = model.shape_world
    for name, values in {
        "hand_coord": hand_coord,
        "hand_dof": hand_dof,
        "hand_base_joint": hand_base,
        "hinge_coord": first_coord[hinges],
        "hinge_dof": first_dof[hinges],
        "object_coord": no_base if scene.fixed_base else first_coord[base_joints],
        "object_dof": no_base if scene.fixed_base else first_dof[base_joints],
        "object_base_joint": base_joints,
        "object_base_body": base_bodies,
        "shape_link": [links.index(owner) if owner in links else -1 for owner in owners],
        "shape_part": [parts.index(owner) if owner in parts else -1 for owner in owners],
    }.items():
        setattr(layout, name, wp.array(values, dtype=int, device=model.device))
    return layout


def _move_hands_away(model: newton.Model, layout: newton_state.NewtonLayout) -> None:
    """Place the hand bases apart: the solver sizes itself by the contacts of the first state, which is no grasp."""
    frames = model.joint_X_p.numpy().reshape(model.world_count, layout.world_joints, -1)
    bases = layout.hand_base_joint.numpy()
    frames[:, bases, 0] = 10.0 * np.arange(1, len(bases) + 1)
    model.joint_X_p.assign(frames.reshape(-1, frames.shape[-1]))


def _short(label: str) -> str:
    """``<side>/<name>`` or ``object<slot>/<name>``, without the world that Newton puts before it."""
    return "/".join(label.split("/")[-2:])
