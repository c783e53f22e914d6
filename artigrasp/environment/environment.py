"""The batched environment: hands manipulate hinged objects, all worlds in step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.config import PhaseConfig, SimulatorConfig, TaskConfig
from artigrasp.environment import tables
from artigrasp.environment.bystanders import Bystanders
from artigrasp.environment.worlds import WorldPlan
from artigrasp.errors import UserError
from artigrasp.kernels import (
    actions,
    episodes,
    features,
    kinematics,
    metrics,
    outcomes,
    phases,
    resets,
    rewards,
    states,
    torques,
)
from artigrasp.kernels.layout import DOF_COUNT, FEATURE_COUNT, HANDS
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.steadying import steadying_hands
from artigrasp.simulation.backend import make_simulation
from artigrasp.simulation.scene import Scene

OPENED_ANGLE = 0.3
"""Change of the hinge angle that counts as articulated [rad] (paper, Metrics)."""


@dataclass(frozen=True)
class ControlStep:
    """What some worlds need besides the physics: at a control step's beginning, in every substep, at its end, after."""

    begin: tuple[wp.Launch, ...]
    apply_torques: wp.Launch
    finish: tuple[wp.Launch, ...]
    observe: wp.Launch


@dataclass(frozen=True)
class ActionTerm:
    """One term of the action: the decisions in force and, for every phase, its columns and how long they hold."""

    held: wp.array
    columns: wp.array
    decision_interval: wp.array


def single_phase(task: TaskConfig) -> PhaseConfig:
    """A task as the one phase of a sequence."""
    return PhaseConfig(task.name, most_steps=task.episode_steps, action=task.action, gains=task.gains)


def describe_failures(counts: Mapping[str, int]) -> str:
    """Counts by :meth:`Environment.failure_counts` in words; empty if nothing failed."""
    found = [f"{name} {count}" for name, count in counts.items() if count]
    return f"failed physics: {', '.join(found)}" if found else ""


class Environment:
    """Worlds of a task; every array is indexed ``[world, hand, ...]`` and stays on the device.

    Call :meth:`reset`, then :meth:`step` once per control step. Nothing here loops over worlds.

    Attributes:
        simulator: Backend, device and threads.
        features: [W, H, 279] features of the paper, by :meth:`observe`.
        reward: [W, H] reward of the last control step.
        reward_terms: its terms by the kernel that computes them: names and [W, H, term] values.
        step_count: [W] control steps since the reset.
        episode: [W] episodes begun so far, which seeds noise and draws.
        phases: What an episode consists of; one phase, the task's own, unless told otherwise.
        phase: Where every world is in it.
        phase_outcome: [W, phase] what became of every phase in this episode, index into ``OUTCOMES``.
        episode_steps: Control steps after which every world has gone through its phases.
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
        self.phases = tuple(sequence or [single_phase(task)])
        self.episode_steps = sum(each.most_steps for each in self.phases) * (1 + retry_count)
        self._retry_count, self._noise = retry_count, noise
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
        self._allocate()
        self._record_kernels()

    @property
    def action_count(self) -> int:
        """Length of one hand's action, the longest of all phases."""
        return max(tables.action_count(each.action) for each in self.phases)

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
            retry_count=self._retry_count,
            seed=self.seed,
            noise=self._noise,
            simulator=self.simulator,
        )
        repeated._bystanders.place_like(self._bystanders, count)
        return repeated

    def reset(self, world_mask: wp.array | None = None) -> None:
        """Begin an episode in the worlds whose mask (int, [W]) is not zero, in all of them by default."""
        world_mask = self._all if world_mask is None else world_mask
        self._launch(
            episodes.begin_episodes,
            self.world_count,
            [world_mask, self._first_reference, self._reference_count, self.episode, self.seed],
            [self.reference_index, self.step_count, self.state.diverged, self.state.overflow_count],
        )
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
        self._launch(phases.reset_outcomes, self.world_count, [world_mask], [self.phase_outcome])
        self._set_phase_goal(world_mask)
        self.simulation.write_state(world_mask)
        self._forward_kinematics.launch()
        self._launch(metrics.reset_metrics, self.world_count, [world_mask, self.goal], [self.metrics])

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
        self._bystanders.set_focus(slot, self._all if world_mask is None else world_mask)

    def step(self, action: wp.array) -> None:
        """Advance every world by one control step.

        Args:
            action: [W, H, action_count]; a term takes its columns only when a decision of it is due.
        """
        if self._terms:
            wp.copy(self._action, action)
        self.simulation.step(self.apply_torques, self._begin_step, self._finish_step)
        if len(self.phases) > 1:
            self._change_phases()

    def advance(self) -> None:
        """Advance every world by one control step toward ``target`` as it stands, which the caller has written."""
        self.simulation.step(self.apply_torques, finish=self._finish_step)

    def _change_phases(self) -> None:
        """End phases that are over and begin the next ones."""
        self._advance_phases.launch()
        self._launch(
            phases.begin_phases,
            self.world_count,
            [
                self._begins, self._references, self._phase_references, self._phase_table, self._phase_limits,
                self._hand_model, self.state.objects,
            ],
            [self.reference_index, self.state.hands, self.goal, self.phase],
        )  # fmt: skip
        self._set_phase_goal(self._begins)
        self.simulation.write_state(self._begins)

    def _set_phase_goal(self, world_mask: wp.array) -> None:
        self._launch(
            phases.set_phase_goal,
            self.world_count,
            [
                world_mask, self._references, self.reference_index, self._phase_table, self.state.objects, self.phase,
            ],
            [self.goal, self.stiffness, self.damping],
        )  # fmt: skip

    @property
    def is_over(self) -> bool:
        """Whether every world has gone through its phases before the time, for want of tries that were allowed."""
        return self._retry_count > 0 and bool(self.phase.finished.numpy().all())

    def observe(self) -> wp.array:
        """Compute and return ``features`` of the present state."""
        self.simulation.launch(self._observe_worlds)
        return self.features

    def episode_summary(self) -> dict[str, NDArray[np.float64]]:
        """What happened in every world since its reset, each of shape [world]; angles in rad, distances in m.

        Of a world whose physics failed, it is what was measured before.
        """
        measured = {
            "final_angle": self.metrics.angle,
            "start_angle": self.goal.start_angle,
            "goal_angle": self.goal.target_angle,
            "angle_error": self.metrics.angle_error,
            "mean_angle_error": self.metrics.angle_error_mean,
            "max_angle_change": self.metrics.angle_change_max,
            "final_displacement": self.metrics.displacement,
            "mean_displacement": self.metrics.displacement_mean,
            "max_displacement": self.metrics.displacement_max,
            "max_tilt": self.metrics.tilt_max,
            "lift": self.metrics.lift,
            "turn": self.metrics.turn,
            "position_error": self.metrics.position_error,
            "mean_position_error": self.metrics.position_error_mean,
            "rotation_error": self.metrics.rotation_error,
            "least_angle_error": self.metrics.angle_error_min,
            "least_position_error": self.metrics.position_error_min,
            "least_rotation_error": self.metrics.rotation_error_min,
        }
        summary = {name: array.numpy().astype(np.float64) for name, array in measured.items()}
        failed = self.metrics.failure.numpy() != 0
        summary["failed"] = failed.astype(np.float64)
        opened = np.abs(summary["final_angle"] - summary["start_angle"]) > OPENED_ANGLE
        summary["success"] = (opened & ~failed).astype(np.float64)
        return summary

    def failure_counts(self) -> dict[str, int]:
        """Episodes so far in which each of :data:`artigrasp.kernels.metrics.FAILURES` happened, by its name."""
        return dict(zip(metrics.FAILURES, self._failure_count.numpy().sum(axis=0).tolist(), strict=True))

    def reference_rows(self) -> NDArray[np.int64]:
        """Row of every world's reference in the set of its object, shape [world]."""
        return self.rows_in_sets(self.reference_index.numpy())

    def rows_in_sets(self, references: NDArray[np.integer]) -> NDArray[np.int64]:
        """Rows of references in the sets of their worlds' objects, of references counted over all sets, [world]."""
        first = np.cumsum([0, *(len(each) for each in self.references)])
        return np.asarray(references - first[self.worlds.object_index])

    def _allocate(self) -> None:
        """The arrays and settings that kernels read and write."""
        task, device = self.task, self.device
        worlds, hands = self.world_count, self.hand_count
        self._hand_model = tables.hand_table(self.hands, device)
        standing = [tables.stand_on_stage(each, task.stage) for each in (*self.references, *self.bystanders)]
        steadying = None
        if any(each.steadies for each in self.phases):
            steadying = [steadying_hands(*each) for each in zip(self.references, self.objects, strict=True)]
            steadying += [np.zeros((len(each), len(HANDS)), bool) for each in self.bystanders]
        self._references = tables.reference_table(standing, task.hands, device, steadying)
        self._reset_settings = tables.reset_settings(task.reset, self._noise)
        self._phase_settings = tables.phase_settings(self.phases, task.reset, task.control_dt, device)
        self._phase_table = tables.phase_table(self.phases, device)
        self._phase_limits = tables.phase_limits(self._retry_count)
        self._synergy_basis = tables.synergy_basis(task.hands, device)
        self._hand_back = wp.array(actions.hand_backs(task.hands), dtype=wp.vec3, device=device)
        self._reward_weights = tables.reward_weights(task.reward)
        self._outcome_weights = tables.outcome_weights(task.reward)
        self._metric_limits = tables.metric_limits(OPENED_ANGLE)
        self.stiffness, self.damping = (wp.zeros((worlds, hands, 3), dtype=float, device=device) for _ in range(2))
        self._effort = wp.array(np.stack([each.effort for each in self.hands]), dtype=float, device=device)

        self._first_reference = wp.array(self.worlds.first_reference, dtype=int, device=device)
        self._reference_count = wp.array(self.worlds.reference_count, dtype=int, device=device)
        self._goal_angle = wp.array(self.worlds.goal_angle, dtype=float, device=device)
        self._all = wp.full(worlds, 1, dtype=int, device=device)
        self.reference_index = wp.zeros(worlds, dtype=int, device=device)
        self.step_count = wp.zeros(worlds, dtype=int, device=device)
        self.episode = wp.zeros(worlds, dtype=int, device=device)
        self.phase = states.phase_state(worlds, device)
        self.phase_outcome = wp.zeros((worlds, len(self.phases)), dtype=int, device=device)
        self._begins = wp.zeros(worlds, dtype=int, device=device)
        self._target_offset = wp.array(self.worlds.target_offsets(), dtype=wp.transform, device=device)
        if self.worlds.second_reference is not None:
            both = np.stack([self.worlds.first_reference, self.worlds.second_reference], axis=1)
            self._phase_references = wp.array(both, dtype=int, device=device)
        self.metrics = metrics.episode_metrics(worlds, device)
        # a row for each range of worlds that is measured by a thread of its own
        rows = (len(self.simulation.torque_rows), len(metrics.FAILURES))
        self._failure_count = wp.zeros(rows, dtype=int, device=device)

        self.target = wp.zeros((worlds, hands, DOF_COUNT), dtype=float, device=device)
        self._action = wp.zeros((worlds, hands, self.action_count), dtype=float, device=device)
        self._synergy = wp.zeros((worlds, hands, actions.SYNERGY_COUNT), dtype=float, device=device)
        self._residual = wp.zeros((worlds, hands, DOF_COUNT), dtype=float, device=device)
        self._terms = [
            ActionTerm(
                held, *(wp.array(column, dtype=int, device=device) for column in tables.term_columns(self.phases, name))
            )
            for name, held in (("synergy", self._synergy), ("residual", self._residual))
            if any(name in phase.action.terms for phase in self.phases)
        ]

        self.features = wp.zeros((worlds, hands, FEATURE_COUNT), dtype=float, device=device)
        self.reward = wp.zeros((worlds, hands), dtype=float, device=device)
        self._paper_terms = wp.zeros((worlds, hands, len(rewards.TERMS)), dtype=float, device=device)
        self._outcome_terms = wp.zeros((worlds, hands, len(outcomes.OUTCOME_TERMS)), dtype=float, device=device)
        self.reward_terms = ((rewards.TERMS, self._paper_terms), (outcomes.OUTCOME_TERMS, self._outcome_terms))

    def _record_kernels(self) -> None:
        """The launches whose arguments stay the same: packing them anew would take longer than most of them."""
        every_hand = (self.world_count, self.hand_count)
        hands, objects = self.state.hands, self.state.objects
        self._control_steps = {
            rows.start: self._record_control_step(block, rows) for block, rows in enumerate(self.simulation.torque_rows)
        }
        self._advance_phases = self._record(
            phases.advance_phases,
            self.world_count,
            [
                hands, objects, self.goal, self.target, self._phase_table, self._phase_limits, self.phase,
                self.phase_outcome, self._begins,
            ],
        )  # fmt: skip
        self._forward_kinematics = self._record(kinematics.forward_kinematics, every_hand, [hands, self._hand_model])

    def _record_control_step(self, block: int, rows: slice) -> ControlStep:
        """What one of the simulation's ranges of worlds needs besides the physics."""
        state = self.state.worlds(rows)
        hands, objects = state.hands, state.objects
        object_model = states.slice_worlds(states.ObjectModel, self._bystanders.object_model, rows)
        goal = states.slice_worlds(states.Goal, self.goal, rows)
        phase = states.slice_worlds(states.PhaseState, self.phase, rows)
        step_count, target, reward = self.step_count[rows], self.target[rows], self.reward[rows]
        worlds = rows.stop - rows.start
        every_hand = (worlds, self.hand_count)

        latches = [
            self._record(
                episodes.latch_actions,
                every_hand,
                [self._action[rows], phase, term.columns, term.decision_interval, term.held[rows]],
            )
            for term in self._terms
        ]
        set_targets = self._record(
            actions.pd_targets,
            every_hand,
            [
                hands, objects, object_model, goal, phase, self._phase_settings, self._synergy_basis,
                self._hand_back, self._synergy[rows], self._residual[rows], target,
            ],
        )  # fmt: skip
        set_torques = self._record(
            torques.pd_torques,
            every_hand,
            [
                target, hands.joint_q, hands.joint_qd, self.stiffness[rows], self.damping[rows], self._effort,
                self.simulation.joint_torque[rows],
            ],
        )  # fmt: skip
        measure = [
            self._record(episodes.advance_steps, worlds, [step_count, phase]),
            self._record(kinematics.forward_kinematics, every_hand, [hands, self._hand_model]),
            self._record(
                rewards.compute_rewards,
                every_hand,
                [
                    hands, objects, object_model, goal, self._reward_weights, self._bystanders.object_mass[rows],
                    self._paper_terms[rows], reward,
                ],
            ),
        ]  # fmt: skip
        if self._outcome_weights is not None:
            outcome = [
                objects, goal, step_count, self.task.episode_steps, OPENED_ANGLE, self._outcome_weights,
                self._outcome_terms[rows], reward,
            ]  # fmt: skip
            measure.append(self._record(outcomes.add_outcome_reward, every_hand, outcome))
        measured = [
            hands, objects, goal, state.diverged, state.overflow_count, self._metric_limits,
            states.slice_worlds(metrics.EpisodeMetrics, self.metrics, rows), self._failure_count[block],
        ]  # fmt: skip
        measure.append(self._record(metrics.update_metrics, worlds, measured))
        observe = self._record(
            features.compute_features,
            every_hand,
            [hands, objects, object_model, goal, int(self.task.include_hinge_features), self.features[rows]],
        )
        return ControlStep((*latches, set_targets), set_torques, tuple(measure), observe)

    def _begin_step(self, rows: slice) -> None:
        for kernel in self._control_steps[rows.start].begin:
            kernel.launch()

    def apply_torques(self, rows: slice) -> None:
        """PD torques of some worlds, one of the simulation's ``torque_rows``, from its present state and ``target``."""
        self._control_steps[rows.start].apply_torques.launch()

    def _finish_step(self, rows: slice) -> None:
        for kernel in self._control_steps[rows.start].finish:
            kernel.launch()

    def _observe_worlds(self, rows: slice) -> None:
        self._control_steps[rows.start].observe.launch()

    def _record(self, kernel: wp.Kernel, dim: int | tuple[int, ...], arguments: list[Any]) -> wp.Launch:
        return wp.launch(kernel, dim, inputs=arguments, device=self.device, record_cmd=True)

    def _launch(self, kernel: wp.Kernel, dim: int | tuple[int, ...], inputs: list[Any], outputs: list[Any]) -> None:
        wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=self.device)
