"""From actions to joint torques: which decisions hold, the PD targets that they make, and the torques towards these."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from artigrasp.assets.hand import HandModel
from artigrasp.config import PhaseConfig, TaskConfig
from artigrasp.environment import tables
from artigrasp.environment.action_columns import last_column, term_adds_up, term_columns
from artigrasp.environment.world_range import WorldRange
from artigrasp.kernels import actions, episodes, torques
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.kernels.synergies import SYNERGY_COUNT
from artigrasp.simulation.launches import record


@dataclass(frozen=True)
class ActionTerm:
    """One term of the action: the decisions in force and, for every phase, its columns and how decisions hold."""

    held: wp.array
    columns: wp.array
    decision_interval: wp.array
    adds_up: wp.array


class Acting:
    """What the hands of all worlds are told.

    Attributes:
        target: [W, H, 51] PD targets, m and rad.
        action_count: Length of one hand's action, which holds those of all phases.
        synergy: [W, H, 14] slow offsets in force, in units of their scales.
        residual: [W, H, 51] fast offsets in force, likewise.
        stiffness, damping: [W, H, 3] PD gains in force of the `DOF_GROUPS`.
        home: [W, H] wrist frames in the world to which the prior "home" leads.
        leads_home: Whether it is the prior of some phase.
    """

    def __init__(
        self, task: TaskConfig, phases: Sequence[PhaseConfig], hands: Sequence[HandModel], world_count: int, device: str
    ) -> None:
        """Allocate.

        Args:
            task: What is simulated.
            phases: The phases of an episode.
            hands: The hands.
            world_count: Number of worlds.
            device: Warp device.
        """
        self._device, shape = device, (world_count, len(hands))
        self.action_count = max(last_column(each) for each in phases)
        self.target = wp.zeros((*shape, DOF_COUNT), dtype=float, device=device)
        self._action = wp.zeros((*shape, self.action_count), dtype=float, device=device)
        self.synergy = wp.zeros((*shape, SYNERGY_COUNT), dtype=float, device=device)
        self.residual = wp.zeros((*shape, DOF_COUNT), dtype=float, device=device)
        self.stiffness, self.damping = (wp.zeros((*shape, 3), dtype=float, device=device) for _ in range(2))
        self.home = wp.zeros(shape, dtype=wp.transform, device=device)
        self.leads_home = any(phase.action.wrist_prior == "home" for phase in phases)
        self._terms = [
            ActionTerm(
                held,
                *(
                    wp.array(setting, dtype=int, device=device)
                    for setting in (
                        *term_columns(phases, name),
                        term_adds_up(phases, name),
                    )
                ),
            )
            for name, held in (("synergy", self.synergy), ("residual", self.residual))
            if any(name in phase.action.terms for phase in phases)
        ]
        self._settings = tables.phase_settings(phases, task.reset, task.control_dt, device)
        self._synergy_basis = tables.synergy_basis(task.hands, device)
        self._hand_back = wp.array(actions.hand_backs(task.hands), dtype=wp.vec3, device=device)
        self._effort = wp.array(np.stack([each.effort for each in hands]), dtype=float, device=device)

    def decide(self, action: wp.array) -> None:
        """Take an action, [W, H, action_count]; a term takes its columns only when a decision of it is due."""
        if self._terms:
            wp.copy(self._action, action)

    def set_targets(self, worlds: WorldRange) -> list[wp.Launch]:
        """The kernels that take over due decisions and set the PD targets, at the beginning of a control step."""
        rows, phase = worlds.rows, worlds.phase
        latches = [
            record(
                episodes.latch_actions,
                worlds.every_hand,
                [self._action[rows], phase, term.columns, term.decision_interval, term.adds_up, term.held[rows]],
                self._device,
            )
            for term in self._terms
        ]
        arguments = [
            worlds.state.hands, worlds.state.objects, worlds.object_model, worlds.goal, phase, self._settings,
            self._synergy_basis, self._hand_back, self.home[rows], self.synergy[rows], self.residual[rows],
            self.target[rows],
        ]  # fmt: skip
        return [*latches, record(actions.pd_targets, worlds.every_hand, arguments, self._device)]

    def set_torques(self, worlds: WorldRange, joint_torque: wp.array) -> wp.Launch:
        """The kernel that sets the torques of all worlds, [W, H, 51], for some of them, in every substep."""
        rows, hands = worlds.rows, worlds.state.hands
        arguments = [
            self.target[rows], hands.joint_q, hands.joint_qd, self.stiffness[rows], self.damping[rows], self._effort,
            joint_torque[rows],
        ]  # fmt: skip
        return record(torques.pd_torques, worlds.every_hand, arguments, self._device)
