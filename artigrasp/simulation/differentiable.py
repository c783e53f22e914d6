"""A short simulation through which gradients flow: the scene of the other backends, by Newton's Featherstone solver.

Contacts are springs and dampers with smoothed friction instead of MuJoCo's constraints, steps are explicit and much
shorter, and bases are fixed. So its motions are near those of the other backends, not theirs;
``docs/differentiable.md`` says what differs, and how far to trust a gradient.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverFeatherstone
from numpy.typing import NDArray

from artigrasp.assets.hand_table import hand_table
from artigrasp.config import PDGains
from artigrasp.config.checks import require_not_negative, require_positive
from artigrasp.errors import UserError
from artigrasp.kernels import newton_joints, states
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.layout import DOF_COUNT, HANDS
from artigrasp.kernels.torques import pd_torques
from artigrasp.simulation.newton import newton_layout
from artigrasp.simulation.scene import Scene, build_newton_worlds

GRAVITY = 9.81
HINGE_STOP = (100.0, 1.0)
"""Stiffness [N·m/rad] and damping [N·m·s/rad] of the ends of a hinge's range; Newton's defaults need shorter steps."""


@dataclass(frozen=True)
class SpringContacts:
    """Contacts that have a gradient.

    A contact's force is ``stiffness * depth - damping * rate`` along the normal; friction is ``friction_damping`` times
    the sliding velocity, at most ``friction`` times the normal force.
    """

    stiffness: float = 2.0e3
    """[N/m]; the two shapes' are averaged."""
    damping: float = 10.0
    """[N·s/m]."""
    friction: float = 1.0
    """Coefficient of friction: the scene's 3 makes fingers stick so hard that gradients are worth little."""
    friction_damping: float = 50.0
    """[N·s/m]."""
    gap: float = 0.005
    """Distance from which on shapes are looked at, so that a contact that begins within a step is seen [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "stiffness", "gap")
        require_not_negative(self, "damping", "friction", "friction_damping")


class DifferentiableRollout:
    """T control steps of W worlds under PD targets.

    Fill the inputs and call :meth:`run`; then :meth:`backward` leads from the outputs back to the ``grad`` arrays of
    the inputs. Every substep has memory of its own, so that nothing that a gradient needs is overwritten.

    Attributes:
        joint_q, joint_qd: Input, joint coordinates and rates at the start, shape [world, hand, 51].
        hinge_q, hinge_qd: Input, hinge angles [rad] and rates [rad/s] at the start, shape [world, object].
        targets: Input, one array of PD targets per control step, shape [world, hand, 51].
        hands: Output, the hands at the end; link poses and keypoints are those of forward kinematics.
        hinge_angles: Output, hinge angles after each control step [rad], T + 1 arrays of shape [world, object], the
            first one being those at the start.
        hinge_rates: Output, likewise [rad/s].
    """

    def __init__(
        self,
        scene: Scene,
        world_count: int,
        control_steps: int,
        *,
        gains: PDGains | None = None,
        contacts: SpringContacts | None = None,
        timestep: float = 5.0e-4,
        device: str = "cpu",
    ) -> None:
        """Build the worlds and room for every substep.

        Args:
            scene: The scene; the bases of its objects must be fixed.
            world_count: Copies of it.
            control_steps: Length of the simulation.
            gains: PD gains of the hands; by default those of the tasks.
            contacts: Properties of contacts.
            timestep: Simulation step [s]; rounded so that a control step has a whole number of them.
            device: Warp device.

        Raises:
            UserError: The bases are free.
        """
        if not scene.fixed_base:
            raise UserError("fixed_base: expected an object with a fixed base, found a free one")
        self.device, self.world_count, self.control_steps = device, world_count, control_steps
        self.substeps = max(1, round(scene.physics.control_dt / timestep))
        self.timestep = scene.physics.control_dt / self.substeps
        self._model = build_newton_worlds([scene], [world_count], device, requires_grad=True)
        self._layout = newton_layout(self._model, scene)
        self._soften(contacts or SpringContacts())
        hand_count, object_count = len(scene.hands), len(scene.objects)

        self.joint_q, self.joint_qd = (self._zeros(world_count, hand_count, DOF_COUNT) for _ in range(2))
        self.hinge_q, self.hinge_qd = (self._zeros(world_count, object_count) for _ in range(2))
        self.targets = [self._zeros(world_count, hand_count, DOF_COUNT) for _ in range(control_steps)]
        self.hinge_angles, self.hinge_rates = (
            [self._zeros(world_count, object_count) for _ in range(control_steps + 1)] for _ in range(2)
        )
        self.hands = states.hand_state(world_count, hand_count, device, requires_grad=True)
        self._hand_model = hand_table(scene.hands, device)
        self._effort = wp.array(np.stack([hand.effort for hand in scene.hands]), dtype=float, device=device)
        groups = (gains or PDGains()).groups
        self._stiffness, self._damping = (
            wp.array(np.tile(values, (world_count, hand_count, 1)), dtype=float, device=device)
            for values in ([group.kp for group in groups], [group.kd for group in groups])
        )

        count = control_steps * self.substeps
        pipeline = newton.CollisionPipeline(self._model, reduce_contacts=False, requires_grad=False)
        self._pipeline = pipeline
        self._states = [self._model.state() for _ in range(count + 1)]
        self._controls = [self._model.control() for _ in range(count)]
        self._contacts = [pipeline.contacts() for _ in range(count)]
        self._tapes: list[wp.Tape] = []
        # The solver keeps its mass matrix, which a gradient needs as it was in each step.
        self._solvers = [SolverFeatherstone(self._model, angular_damping=0.0) for _ in range(count)]
        self._substep_q, self._substep_qd, self._torque = (
            [self._zeros(world_count, hand_count, DOF_COUNT) for _ in range(count)] for _ in range(3)
        )
        self._weigh_objects()

    def place(self, hand_base: NDArray[np.floating], object_pose: NDArray[np.floating]) -> None:
        """Put the hands' base frames and the objects' bases where they stay, which is no differentiable input.

        Args:
            hand_base: Position [m], quaternion xyzw, shape [world, hand, 7].
            object_pose: The same of the objects' bases, shape [world, object, 7].
        """
        self.hands.hand_base.assign(hand_base.astype(np.float32))
        frames = self._model.joint_X_p.numpy().reshape(self.world_count, self._layout.world_joints, 7)
        frames[:, self._layout.hand_base_joint.numpy()] = hand_base
        frames[:, self._layout.object_base_joint.numpy()] = object_pose
        self._model.joint_X_p.assign(frames.reshape(-1, 7))

    def run(self) -> None:
        """Simulate from the start."""
        self._zero_gradients()
        self._tapes = []
        with self._recorded():
            self._write_start()
        for step in range(self.control_steps):
            with self._recorded():
                self._read_hinges(step)
            for substep in range(step * self.substeps, (step + 1) * self.substeps):
                self._find_contacts(substep)
                with self._recorded():
                    self._advance(substep, self.targets[step])
        with self._recorded():
            self._read_hinges(self.control_steps)
            self._read_end()

    def backward(self, gradients: Mapping[wp.array, wp.array]) -> None:
        """Lead gradients of outputs of the last run back to the inputs, whose ``grad`` is overwritten.

        Args:
            gradients: What a loss changes by per change of an output, by the output: any of ``hinge_angles`` and
                ``hinge_rates``, and of ``joint_q``, ``joint_qd``, ``link_pose`` and ``keypoint`` of ``hands``.
        """
        self._zero_gradients()
        for output, gradient in gradients.items():
            output.grad.assign(gradient)
        for tape in reversed(self._tapes):
            tape.backward()

    def contact_count(self) -> int:
        """Pairs of shapes within the gap in the last substep of the last run, over all worlds."""
        return int(self._contacts[-1].rigid_contact_count.numpy()[0])

    def _zero_gradients(self) -> None:
        # A tape knows its arrays only once it has run backwards.
        for tape in self._tapes:
            tape.zero()

    @contextmanager
    def _recorded(self) -> Iterator[None]:
        """Launches that have a gradient; the search for contacts between them has none and would only be in the way."""
        with wp.Tape() as tape:
            yield
        self._tapes.append(tape)

    def _write_start(self) -> None:
        first = self._states[0]
        hands, slots = self.joint_q.shape, self.hinge_q.shape
        self._launch(
            newton_joints.write_hands,
            hands,
            [self.joint_q, self.joint_qd, self._layout],
            [first.joint_q, first.joint_qd],
        )
        self._launch(
            newton_joints.write_hinges,
            slots,
            [self.hinge_q, self.hinge_qd, self._layout],
            [first.joint_q, first.joint_qd],
        )

    def _read_end(self) -> None:
        last = self._states[-1]
        self._launch(
            newton_joints.read_hands,
            self.joint_q.shape,
            [last.joint_q, last.joint_qd, self._layout],
            [self.hands.joint_q, self.hands.joint_qd],
        )
        self._launch(forward_kinematics, self.joint_q.shape[:2], [self.hands, self._hand_model], [])

    def _advance(self, substep: int, target: wp.array) -> None:
        state, control = self._states[substep], self._controls[substep]
        joint_q, joint_qd, torque = self._substep_q[substep], self._substep_qd[substep], self._torque[substep]
        self._launch(
            newton_joints.read_hands, torque.shape, [state.joint_q, state.joint_qd, self._layout], [joint_q, joint_qd]
        )
        self._launch(
            pd_torques,
            torque.shape[:2],
            [target, joint_q, joint_qd, self._stiffness, self._damping, self._effort],
            [torque],
        )
        self._launch(newton_joints.write_torques, torque.shape, [torque, self._layout], [control.joint_f])
        self._solvers[substep].step(state, self._states[substep + 1], control, self._contacts[substep], self.timestep)

    def _find_contacts(self, substep: int) -> None:
        """Contact points and normals, which have no gradient; that of the depth comes from the moving bodies."""
        state = self._states[substep]
        newton.eval_fk(self._model, state.joint_q, state.joint_qd, state)
        self._pipeline.collide(state, self._contacts[substep])

    def _read_hinges(self, step: int) -> None:
        state = self._states[step * self.substeps]
        self._launch(
            newton_joints.read_hinges,
            self.hinge_q.shape,
            [state.joint_q, state.joint_qd, self._layout],
            [self.hinge_angles[step], self.hinge_rates[step]],
        )

    def _soften(self, contacts: SpringContacts) -> None:
        model = self._model
        model.shape_material_ke.fill_(contacts.stiffness)
        model.shape_material_kd.fill_(contacts.damping)
        model.shape_material_kf.fill_(contacts.friction_damping)
        model.shape_material_mu.fill_(contacts.friction)
        model.shape_gap.fill_(contacts.gap)
        dofs = self._layout.hinge_dof.numpy() + np.arange(self.world_count)[:, None] * self._layout.world_dofs
        for values, value in zip((model.joint_limit_ke, model.joint_limit_kd), HINGE_STOP, strict=True):
            changed = values.numpy()
            changed[dofs] = value
            values.assign(changed)

    def _weigh_objects(self) -> None:
        """Weightless hands, as in the other backends: gravity is a force on the bodies of objects alone.

        Newton's own gravity with a force that lifts the hands moves alike, but spoils gradients by percents.
        """
        self._model.gravity.zero_()
        is_hand = np.array([label.split("/")[-2] in HANDS for label in self._model.body_label])
        force = np.zeros((self._model.body_count, 6), np.float32)
        force[:, 2] = -GRAVITY * self._model.body_mass.numpy() * ~is_hand
        for state in self._states:
            state.body_f.assign(force)

    def _zeros(self, *shape: int) -> wp.array:
        return wp.zeros(shape, dtype=float, device=self.device, requires_grad=True)

    def _launch(self, kernel: wp.Kernel, dim: tuple[int, ...], inputs: list[object], outputs: list[object]) -> None:
        wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=self.device)
