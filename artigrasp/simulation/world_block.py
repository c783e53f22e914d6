"""A share of the worlds of the CPU backend, which one thread takes through a control step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import warp as wp
from mujoco.rollout import Rollout

from artigrasp.arrays import Array
from artigrasp.kernels import mujoco_state
from artigrasp.simulation.launches import OnWorlds, record
from artigrasp.simulation.mujoco_warnings import CAPACITY_WARNINGS, warning_count
from artigrasp.simulation.state import SimulationState

CONTROL = (
    mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
    | mujoco.mjtState.mjSTATE_MOCAP_POS.value
    | mujoco.mjtState.mjSTATE_MOCAP_QUAT.value
)
"""What a control row holds."""


@dataclass(frozen=True)
class PackedWorlds:
    """MuJoCo's own vectors, one row per world, float64."""

    state: Array
    """FULLPHYSICS state: time, qpos, qvel."""
    control: Array
    """Generalised forces, mocap positions, mocap quaternions."""
    sensor: Array
    """Sensor readings of the last substep."""
    warmstart: Array
    """Accelerations from which the constraint solver starts."""

    def rows(self, rows: slice) -> PackedWorlds:
        """Views of some worlds."""
        return PackedWorlds(self.state[rows], self.control[rows], self.sensor[rows], self.warmstart[rows])


class WorldBlock:
    """Consecutive worlds of one scene.

    A block goes through all substeps of a control step without waiting for others, kernels included, so that threads
    meet once per control step. Blocks share no rows, so they may be stepped at the same time. Kernels that are launched
    by several threads must not use Warp's tiles, whose storage all threads share.

    Attributes:
        rows: Its worlds.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        rows: slice,
        packed: PackedWorlds,
        state: SimulationState,
        joint_torque: wp.array,
        layout: mujoco_state.StateLayout,
        substeps: int,
    ) -> None:
        """Record the launches of the block's kernels.

        Args:
            model: The compiled scene.
            rows: The block's worlds.
            packed: Vectors of all worlds.
            state: State of all worlds.
            joint_torque: Torques of all worlds, [W, H, 51].
            layout: Columns of the packed vectors.
            substeps: Simulation steps per control step.
        """
        self.rows = rows
        self._packed = packed = packed.rows(rows)
        self._next_state = np.empty_like(packed.state)
        # rollout does not tell the accelerations it ended with, from which its next call should start: they are guessed
        # from what the velocities changed by. That is less than acceleration times timestep, for the integrator takes
        # the joints' damping at the end of the step: by this factor if the inertia matrix is diagonal, as it nearly is.
        acceleration_per_velocity_change = wp.array(
            1.0 / model.opt.timestep + model.dof_damping / model.dof_M0, dtype=wp.float64, device="cpu"
        )
        self._models = [model] * len(packed.state)
        self._data = [mujoco.MjData(model)]
        self._rollout = Rollout(nthread=0)

        self._state = state = state.worlds(rows)
        self._overflow_count = state.overflow_count.numpy()
        mujoco_state_rows, control, sensor, warmstart, next_state = (
            wp.array(each, dtype=wp.float64, device="cpu", copy=False)
            for each in (packed.state, packed.control, packed.sensor, packed.warmstart, self._next_state)
        )
        worlds, hand_count = state.hands.joint_q.shape[:2]
        self._pack_torques = record(
            mujoco_state.pack_torques, (worlds, hand_count), [joint_torque[rows], layout, control], "cpu"
        )
        self._finish_substep = [
            record(
                mujoco_state.finish_substep,
                (worlds,),
                [
                    next_state, sensor, layout, state.focus, 1 + model.nq, acceleration_per_velocity_change,
                    1.0 / substeps, int(substep == 0), mujoco_state_rows, warmstart, state.hands,
                ],
                "cpu",
            )
            for substep in range(substeps)
        ]  # fmt: skip
        self._unpack_objects = record(
            mujoco_state.unpack_objects,
            (worlds, state.object_count),
            [mujoco_state_rows, layout, state.slots, state.diverged],
            "cpu",
        )

    def step(self, apply_torques: OnWorlds, begin: OnWorlds, finish: OnWorlds) -> None:
        """Advance the block by one control step; see :meth:`CpuSimulation.step`."""
        packed = self._packed
        begin(self.rows)
        for finish_substep in self._finish_substep:
            apply_torques(self.rows)
            self._pack_torques.launch()
            warnings = warning_count()
            self._substep(slice(0, len(packed.state)))
            if warning_count() > warnings:
                self._count_overflows()
            finish_substep.launch()
        self._unpack_objects.launch()
        self._state.read_focus()
        finish(self.rows)

    def _substep(self, worlds: slice) -> None:
        """Simulate some of the block's worlds for one substep, from the packed state to the next one."""
        packed = self._packed.rows(worlds)
        self._rollout.rollout(
            self._models[worlds],
            self._data,
            packed.state,
            packed.control,
            control_spec=CONTROL,
            skip_checks=True,
            nstep=1,
            initial_warmstart=packed.warmstart,
            state=self._next_state[worlds],
            sensordata=packed.sensor,
        )

    def _count_overflows(self) -> None:
        """Find the worlds whose contacts or constraints did not fit.

        All worlds are stepped in one ``MjData``, which knows the warnings of the last only: the substep is repeated
        world by world. Worlds that diverged need no such search, their clock shows it.
        """
        for world in range(len(self._packed.state)):
            self._substep(slice(world, world + 1))
            warnings = self._data[0].warning
            if any(warnings[kind].number for kind in CAPACITY_WARNINGS):
                self._overflow_count[world] += 1


def split_worlds(world_counts: Sequence[int], block_count: int) -> list[tuple[int, slice]]:
    """Share worlds out in blocks of about equal size, none of which has worlds of two scenes.

    Args:
        world_counts: Worlds of each scene, one scene after the other.
        block_count: Blocks wanted; more where scenes are many or their worlds do not divide.

    Returns:
        Scene and worlds of each block.
    """
    size = max(1, -(-sum(world_counts) // block_count))
    blocks: list[tuple[int, slice]] = []
    start = 0
    for scene, count in enumerate(world_counts):
        pieces = -(-count // size)
        for piece in range(pieces):
            blocks.append((scene, slice(start + count * piece // pieces, start + count * (piece + 1) // pieces)))
        start += count
    return blocks
