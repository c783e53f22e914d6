"""The batched environment: hands manipulate hinged objects, all worlds in step."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_table import hand_table
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.config import PhaseConfig, SimulatorConfig, TaskConfig
from artigrasp.environment import tables
from artigrasp.environment.acting import Acting
from artigrasp.environment.beginning import Beginning
from artigrasp.environment.bystanders import Bystanders
from artigrasp.environment.control_steps import ControlSteps
from artigrasp.environment.instant import Instant
from artigrasp.environment.measuring import Measuring
from artigrasp.environment.phase_machine import PhaseMachine, single_phase
from artigrasp.environment.rewarding import Rewarding
from artigrasp.environment.world_range import WorldRange
from artigrasp.environment.worlds import WorldPlan
from artigrasp.errors import UserError
from artigrasp.kernels import episodes, kinematics, metrics, resets, states
from artigrasp.kernels.layout import FEATURE_COUNT, HANDS
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.steadying import steadying_hands
from artigrasp.simulation.backend import make_simulation
from artigrasp.simulation.scene import Scene


class Environment:
    """Worlds of a task; every array is indexed ``[world, hand, ...]`` and stays on the device.

    Call :meth:`reset`, then :meth:`step` once per control step. Nothing here loops over worlds.

    Attributes:
        simulator: Backend, device and threads.
        features: [W, H, 279] features of the paper, by :meth:`observe`.
        step_count: [W] control steps since the reset.
        episode: [W] episodes begun so far, which seeds noise and draws.
        phases: What an episode consists of; one phase, the task's own, unless told otherwise.
    """

    def __init__(
        self,
        task: TaskConfig,
        references: Sequence[ReferenceSet],
        worlds: WorldPlan,
        *,
        bystanders: Sequence[ReferenceSet] = (),
        sequence: Sequence[PhaseConfig] | None = None,
        retry_count: int = 0,
        seed: int = 0,
        noise: bool = True,
        simulator: SimulatorConfig = SimulatorConfig(),
    ) -> None:
        """Load the assets, compile the scenes and allocate the worlds.

        Args:
            task: What is simulated and rewarded.
            references: One set per object, each of them already cut down to the task's kinds.
            worlds: What each world plays.
            bystanders: Further objects of every world, in slots 1, 2, ... of its scene, each with a reference at least.
                They stand 1 m apart until :meth:`place_bystander`.
            sequence: Phases of an episode; the task's action and gains for all its steps by default.
            retry_count: How often an episode may go back after a failed phase.
            seed: Seed of everything that is drawn on the device.
            noise: Whether hands start with the task's noise.
            simulator: Backend, device and threads.

        Raises:
            UserError: The references belong to different hand models, or an asset, backend or device is missing.
        """
        self.task, self.seed, self.worlds, self.simulator = task, seed, worlds, simulator
        self.phases, self._noise = tuple(sequence or [single_phase(task)]), noise
        hand_names = sorted({each.hand for each in (*references, *bystanders)})
        if len(hand_names) != 1:
            raise UserError(f"references: expected one hand model for all objects, found {', '.join(hand_names)}")
        self.hand_name = hand_names[0]
        self.object_names = tuple(each.object for each in references)
        self.references, self.bystanders = tuple(references), tuple(bystanders)
        self.hands = tuple(load_hand(self.hand_name, side) for side in task.hands)
        self.objects: tuple[ObjectModel, ...] = tuple(load_object(name) for name in self.object_names)
        beside = tuple(load_object(each.object) for each in bystanders)
        scenes = [
            Scene(self.hands, (each, *beside), task.fixed_base, task.physics, task.stage) for each in self.objects
        ]
        counts = np.bincount(worlds.object_index, minlength=len(scenes)).tolist()
        self.simulation = make_simulation(
            simulator.backend, scenes, counts, thread_count=simulator.threads, device=simulator.device
        )
        self.state = self.simulation.state
        self.device = self.simulation.device
        self.world_count, self.hand_count = worlds.world_count, len(self.hands)
        self.goal = states.goal(self.world_count, self.hand_count, self.device)
        self._bystanders = Bystanders(self.objects, beside, bystanders, worlds, task.fixed_base, self.state, self.goal)
        self._hand_model = hand_table(self.hands, self.device)
        self._references = self._reference_table()
        self._reset_settings = tables.reset_settings(task.reset, noise)
        self._acting = Acting(task, self.phases, self.hands, self.world_count, self.device)
        self._machine = PhaseMachine(
            self.phases, retry_count, worlds, self.state, self.goal, self._acting, self._references, self._hand_model
        )
        self._rewarding = Rewarding(task, self._bystanders.object_mass, self.hand_count)
        ranges = self.simulation.torque_rows
        opens = any(phase.opens for phase in self.phases)
        self._measuring = Measuring(self.world_count, len(ranges), opens, self.device)
        self.features = self._zeros(float, self.hand_count, FEATURE_COUNT)
        self.step_count, self.episode = self._zeros(int), self._zeros(int)
        self._every_world = wp.full(self.world_count, 1, dtype=int, device=self.device)
        self._first_reference = wp.array(worlds.first_reference, dtype=int, device=self.device)
        self._reference_count = wp.array(worlds.reference_count, dtype=int, device=self.device)
        reference_count = sum(len(each) for each in self.references)
        self.reference_weight = wp.full(reference_count, 1.0, dtype=float, device=self.device)
        self._goal_angle = wp.array(worlds.goal_angle, dtype=float, device=self.device)
        self._target_offset = wp.array(worlds.target_offsets(), dtype=wp.transform, device=self.device)
        self._beginning: Beginning | None = None
        self._kernels = ControlSteps(
            [self._world_range(index, rows) for index, rows in enumerate(ranges)],
            self._acting,
            self._rewarding,
            self._measuring,
            self._hand_model,
            joint_torque=self.simulation.joint_torque,
            observed=self.features,
            with_hinge=task.include_hinge_features,
        )

    @property
    def action_count(self) -> int:
        """Length of one hand's action, which holds those of all phases."""
        return self._acting.action_count

    @property
    def episode_steps(self) -> int:
        """Control steps after which every world has gone through its phases."""
        return self._machine.episode_steps

    @property
    def phase(self) -> states.PhaseState:
        """Where every world is in its phases."""
        return self._machine.state

    @property
    def phase_outcome(self) -> wp.array:
        """[W, phase] what became of every phase in this episode, index into ``OUTCOMES``."""
        return self._machine.outcome

    @property
    def reference_index(self) -> wp.array:
        """[W] the reference that every world plays now, counted over all sets."""
        return self._machine.reference_index

    @property
    def target(self) -> wp.array:
        """[W, H, 51] PD targets of all joints, m and rad."""
        return self._acting.target

    @property
    def stiffness(self) -> wp.array:
        """[W, H, 3] stiffness in force of the `DOF_GROUPS`."""
        return self._acting.stiffness

    @property
    def damping(self) -> wp.array:
        """[W, H, 3] damping in force of the `DOF_GROUPS`."""
        return self._acting.damping

    @property
    def home(self) -> wp.array:
        """[W, H] wrist frames in the world to which the wrist prior "home" leads."""
        return self._acting.home

    @property
    def reward(self) -> wp.array:
        """[W, H] reward of the last control step."""
        return self._rewarding.total

    @property
    def reward_terms(self) -> tuple[tuple[tuple[str, ...], wp.array], ...]:
        """Its terms by the kernel that computes them: names and [W, H, term] values."""
        return self._rewarding.terms

    @property
    def metrics(self) -> metrics.EpisodeMetrics:
        """What was measured since the resets."""
        return self._measuring.metrics

    @property
    def object_model(self) -> states.ObjectModel:
        """Hinge and masses of every world's object, as kernels take them."""
        return self._bystanders.object_model

    def repeat(self, count: int | NDArray[np.integer], phases: Sequence[PhaseConfig] | None = None) -> "Environment":
        """An environment with every world so many times, side by side; its episodes start anew.

        Args:
            count: A number, or one for every world, zero for those that are left out.
            phases: What an episode consists of; all of this one's phases by default.
        """
        worlds = self.worlds.repeat(count)
        repeated = Environment(
            self.task,
            self.references,
            worlds,
            bystanders=self.bystanders,
            sequence=phases or self.phases,
            retry_count=self._machine.retry_count,
            seed=self.seed,
            noise=self._noise,
            simulator=self.simulator,
        )
        repeated._bystanders.place_like(self._bystanders, count)
        if (begins := self._beginning) is not None:
            target = np.repeat(begins.target_object_pose, count, axis=0)
            repeated.begin_at(begins.instant, np.repeat(begins.keeps, count, axis=0), target)
        return repeated

    def begin_at(self, instant: Instant, keeps: NDArray[np.bool_], target_object_pose: ArrayLike) -> None:
        """Let all episodes from the next reset on begin at an instant, and not where their references start.

        Args:
            instant: Where the world's object, then the bystanders, and the hands are.
            keeps: Hands that keep their targets and gains through all phases, shape [W, H]; their references must not
                ask anything of them.
            target_object_pose: Where the object should go, position [m] and xyzw in the world, shape [7] or [W, 7].
        """
        self._beginning = Beginning(
            instant,
            keeps,
            target_object_pose,
            physics=self.state,
            goal=self.goal,
            phase=self.phase,
            acting=self._acting,
        )
        self._beginning.place_objects(self._bystanders)

    def reset(self, world_mask: wp.array | None = None) -> None:
        """Begin an episode in the worlds whose mask (int, [W]) is not zero, in all of them by default."""
        if self._beginning is None and self._acting.leads_home:
            raise ValueError('the wrist prior "home" needs an instant to begin at, which says where hands wait')
        world_mask = self._every_world if world_mask is None else world_mask
        self._launch(
            episodes.begin_episodes,
            self.world_count,
            [
                world_mask, self._first_reference, self._reference_count, self.reference_weight, self.task.practice,
                self.episode, self.seed,
            ],
            [self.reference_index, self.step_count, self.state.diverged, self.state.overflow_count],
        )  # fmt: skip
        self._bystanders.reset(world_mask)
        self._launch(
            resets.reset_worlds,
            self.world_count,
            [
                world_mask, self.reference_index, self._goal_angle, self._target_offset, self.episode, self.seed,
                self._references, self._reset_settings, self._hand_model, self._bystanders.object_model,
            ],
            [self.state.hands, self.state.objects, self.goal, self.phase],
        )  # fmt: skip
        if self._beginning is not None:
            self._bystanders.put_in_place(world_mask)
            self._beginning.resume(world_mask, self._goal_angle)
        self._machine.begin_episodes(world_mask)
        self.simulation.write_state(world_mask)
        every_hand = (self.world_count, self.hand_count)
        self._launch(kinematics.forward_kinematics, every_hand, [self.state.hands, self._hand_model], [])
        self._measuring.reset(world_mask, self.goal)

    def place_bystander(self, slot: int, pose: ArrayLike, angle: ArrayLike = 0.0) -> None:
        """Say where a bystander stands from the next reset on.

        Args:
            slot: Which one, counted from 1.
            pose: Frame of its base in the world, position [m] and xyzw, shape [7] or [W, 7].
            angle: Its hinge angle [rad], a number or of shape [W].
        """
        self._bystanders.place(slot, pose, angle)

    def set_focus(self, slot: int, world_mask: wp.array | None = None) -> None:
        """Let the hands manipulate another of the scene's objects; a reset brings slot 0 back.

        Features, rewards, metrics and contact forces are about the object in focus, forces from the next step on.
        Displacements count from where it is now. What hands are asked to do stays: write a new ``goal``.

        Args:
            slot: Index of the object in the scene; 0 is the one of the world's references.
            world_mask: Where, int, [W]; everywhere by default.
        """
        self._bystanders.set_focus(slot, self._every_world if world_mask is None else world_mask)

    def step(self, action: wp.array) -> None:
        """Advance every world by one control step.

        Args:
            action: [W, H, action_count]; a term takes its columns only when a decision of it is due.
        """
        self._acting.decide(action)
        self.simulation.step(self.apply_torques, self._kernels.begin, self._kernels.finish)
        if len(self.phases) > 1:
            self._machine.advance()
            self.simulation.write_state(self._machine.begins)

    def advance(self) -> None:
        """Advance every world by one control step toward ``target`` as it stands, which the caller has written."""
        self.simulation.step(self.apply_torques, finish=self._kernels.finish)

    def apply_torques(self, rows: slice) -> None:
        """PD torques of some worlds, one of the simulation's ``torque_rows``, from its present state and ``target``."""
        self._kernels.apply_torques(rows)

    @property
    def is_over(self) -> bool:
        """Whether every world has gone through its phases before the time, for want of tries that were allowed."""
        return self._machine.is_over

    def observe(self) -> wp.array:
        """Compute and return ``features`` of the present state."""
        self.simulation.launch(self._kernels.observe)
        return self.features

    def episode_summary(self) -> dict[str, Array]:
        """What happened in every world since its reset, each of shape [world]; angles in rad, distances in m.

        Of a world whose physics failed, it is what was measured before. Where there are bystanders, ``bystander_shift``
        and ``bystander_turn`` tell how far they are from their places now.
        """
        return self._measuring.summary(self.goal) | (self._bystanders.disturbance() if self.bystanders else {})

    def failure_counts(self) -> dict[str, int]:
        """Episodes so far in which each of :data:`artigrasp.kernels.metrics.FAILURES` happened, by its name."""
        return self._measuring.failure_counts()

    def reference_rows(self) -> NDArray[np.int64]:
        """Row of every world's reference in the set of its object, shape [world]."""
        return self.rows_in_sets(self.reference_index.numpy())

    def rows_in_sets(self, references: NDArray[np.integer]) -> NDArray[np.int64]:
        """Rows of references in the sets of their worlds' objects, of references counted over all sets, [world]."""
        first = np.cumsum([0, *(len(each) for each in self.references)])
        return np.asarray(references - first[self.worlds.object_index])

    def _reference_table(self) -> resets.ReferenceTable:
        """All references, those of bystanders last."""
        standing = [tables.stand_on_stage(each, self.task.stage) for each in (*self.references, *self.bystanders)]
        steadying = None
        if any(each.steadies for each in self.phases):
            steadying = [steadying_hands(*each) for each in zip(self.references, self.objects, strict=True)]
            steadying += [np.zeros((len(each), len(HANDS)), bool) for each in self.bystanders]
        return tables.reference_table(standing, self.task.hands, self.device, steadying)

    def _world_range(self, index: int, rows: slice) -> WorldRange:
        """One of the simulation's ranges of worlds."""
        return WorldRange(
            index=index,
            rows=rows,
            state=self.state.worlds(rows),
            object_model=states.slice_worlds(states.ObjectModel, self.object_model, rows),
            goal=states.slice_worlds(states.Goal, self.goal, rows),
            phase=states.slice_worlds(states.PhaseState, self.phase, rows),
            step_count=self.step_count[rows],
        )

    def _zeros(self, dtype: type, *shape: int) -> wp.array:
        return wp.zeros((self.world_count, *shape), dtype=dtype, device=self.device)

    def _launch(self, kernel: wp.Kernel, dim: int | tuple[int, ...], inputs: list[Any], outputs: list[Any]) -> None:
        wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=self.device)
