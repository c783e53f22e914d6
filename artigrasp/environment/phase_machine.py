"""The phases of an episode: which one every world is in, and what became of the others."""

from collections.abc import Sequence

import numpy as np
import warp as wp

from artigrasp.config import PhaseConfig, TaskConfig
from artigrasp.environment import tables
from artigrasp.environment.acting import Acting
from artigrasp.environment.worlds import WorldPlan
from artigrasp.kernels import episodes, phase_starts, phases, resets, states
from artigrasp.simulation.launches import record
from artigrasp.simulation.state import SimulationState


def single_phase(task: TaskConfig) -> PhaseConfig:
    """A task as the one phase of a sequence."""
    return PhaseConfig(task.name, most_steps=task.episode_steps, action=task.action, gains=task.gains)


class PhaseMachine:
    """Lets every world go through its phases, each at its own time; nothing is read on the host.

    Attributes:
        phases: What an episode consists of.
        episode_steps: Control steps after which every world has gone through its phases.
        state: Where every world is in it.
        outcome: [W, phase] what became of every phase in this episode, index into ``OUTCOMES``.
        reference_index: [W] the reference that is played.
        begins: [W] 1 where :meth:`advance` began a phase.
    """

    def __init__(
        self,
        sequence: Sequence[PhaseConfig],
        retry_count: int,
        worlds: WorldPlan,
        physics: SimulationState,
        goal: states.Goal,
        acting: Acting,
        references: resets.ReferenceTable,
        hand_model: states.HandModel,
    ) -> None:
        """Allocate.

        Args:
            sequence: The phases.
            retry_count: How often an episode may go back after a failed phase.
            worlds: What each world plays.
            physics: The worlds' state.
            goal: What hands and objects are asked, which phases change.
            acting: Whose gains phases change, and whose targets tell when wrists have arrived.
            references: The references.
            hand_model: The hands.
        """
        self.phases = tuple(sequence)
        self.episode_steps = sum(each.most_steps for each in self.phases) * (1 + retry_count)
        self.retry_count = retry_count
        self._physics, self._goal, self._acting = physics, goal, acting
        self._references, self._hand_model, self._device = references, hand_model, physics.focus.device
        self._table = tables.phase_table(self.phases, self._device)
        self._limits = tables.phase_limits(retry_count)
        self.state = states.phase_state(worlds.world_count, self._device)
        self.outcome = wp.zeros((worlds.world_count, len(self.phases)), dtype=int, device=self._device)
        self.reference_index = wp.zeros(worlds.world_count, dtype=int, device=self._device)
        self.begins = wp.zeros(worlds.world_count, dtype=int, device=self._device)
        self._has_second = worlds.second_reference is not None
        second = worlds.first_reference if worlds.second_reference is None else worlds.second_reference
        both = np.stack([worlds.first_reference, second], axis=1)
        self._references_of_world = wp.array(both, dtype=int, device=self._device)
        hands, objects = physics.hands, physics.objects
        end = [
            hands, objects, goal, acting.target, self._table, self._limits, self.state, self.outcome, self.begins,
        ]  # fmt: skip
        begin = [
            self.begins, references, self._references_of_world, self._table, self._limits, hand_model, objects,
            self.reference_index, hands, goal, self.state,
        ]  # fmt: skip
        self._change = [
            record(phases.advance_phases, worlds.world_count, end, self._device),
            record(phase_starts.begin_phases, worlds.world_count, begin, self._device),
        ]

    def begin_episodes(self, world_mask: wp.array) -> None:
        """Keep the references drawn, forget what became of phases, and set what the first asks.

        Args:
            world_mask: Int, [W], not zero where episodes begin.
        """
        drawn = [world_mask, self.reference_index, int(not self._has_second)]
        wp.launch(episodes.keep_references, world_mask.shape, drawn, [self._references_of_world], device=self._device)
        wp.launch(phases.reset_outcomes, world_mask.shape, [world_mask], [self.outcome], device=self._device)
        self._set_goal(world_mask)

    def advance(self) -> None:
        """End phases that are over and begin the next ones; the physics must be told where :attr:`begins` says so."""
        for kernel in self._change:
            kernel.launch()
        self._set_goal(self.begins)

    def _set_goal(self, world_mask: wp.array) -> None:
        inputs = [
            world_mask, self._references, self.reference_index, self._table, self._physics.objects, self.state,
        ]  # fmt: skip
        outputs = [self._goal, self._acting.stiffness, self._acting.damping]
        wp.launch(phase_starts.set_phase_goal, world_mask.shape, inputs, outputs, device=self._device)

    @property
    def is_over(self) -> bool:
        """Whether every world has gone through its phases before the time, for want of tries that were allowed."""
        return self.retry_count > 0 and bool(self.state.finished.numpy().all())
