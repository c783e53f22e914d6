"""The CPU backend: batched MuJoCo rollouts on all cores."""

import logging
import os
from collections.abc import Callable, Sequence

import mujoco
import numpy as np
import warp as wp
from mujoco.rollout import Rollout
from numpy.typing import NDArray

from artigrasp.kernels import mujoco_state
from artigrasp.simulation.mujoco_model import ModelLayout, compile_mujoco, model_layout
from artigrasp.simulation.scene import Scene
from artigrasp.simulation.state import allocate_state

logger = logging.getLogger(__name__)

# Without a handler MuJoCo writes its warnings to a file in whatever folder the user is in. Worlds that failed are
# marked in the state, so a warning is only for those who debug.
mujoco.set_mju_user_warning(logger.debug)

_CONTROL = (
    mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
    | mujoco.mjtState.mjSTATE_MOCAP_POS.value
    | mujoco.mjtState.mjSTATE_MOCAP_QUAT.value
)


class CpuSimulation:
    """Worlds in contiguous slices, one slice and one compiled MuJoCo model per scene.

    Attributes:
        state: The batched state; write into it and call :meth:`write_state` to reset worlds.
        joint_torque: Joint torques [N, N·m] that the next substep applies, float32, shape [world, hand, 51].
        models: The compiled model of every scene.
    """

    device = "cpu"

    def __init__(self, scenes: Sequence[Scene], world_counts: Sequence[int], thread_count: int | None = None) -> None:
        """Compile the scenes and allocate the worlds.

        Args:
            scenes: Scenes with the same hands, base kind and physics; only the object may differ.
            world_counts: Worlds of each scene.
            thread_count: Threads that step the physics, all cores by default.
        """
        self.scenes = tuple(scenes)
        self.models = [compile_mujoco(scene) for scene in scenes]
        layouts = [model_layout(model, scene) for model, scene in zip(self.models, scenes, strict=True)]
        self.world_count = sum(world_counts)
        self.hand_count = len(scenes[0].hands)
        self.substeps = scenes[0].physics.substeps
        thread_count = thread_count or os.cpu_count() or 1
        self._rollout = Rollout(nthread=thread_count)
        self._data = [[mujoco.MjData(model) for _ in range(thread_count)] for model in self.models]
        ends = np.cumsum(world_counts)
        self._slices = [slice(int(end) - count, int(end)) for end, count in zip(ends, world_counts, strict=True)]

        model = self.models[0]
        state_size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
        control_size = mujoco.mj_stateSize(model, _CONTROL)
        self._state = np.zeros((self.world_count, state_size))
        self._next_state = np.zeros((self.world_count, 1, state_size))
        self._control = np.zeros((self.world_count, 1, control_size))
        self._sensor = np.zeros((self.world_count, 1, model.nsensordata))
        self._warmstart = np.zeros((self.world_count, model.nv))
        self._qvel = slice(1 + model.nq, 1 + model.nq + model.nv)
        self._timestep = model.opt.timestep
        for rows, compiled in zip(self._slices, self.models, strict=True):
            data = mujoco.MjData(compiled)
            mujoco.mj_getState(compiled, data, self._state[rows.start], mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
            self._state[rows] = self._state[rows.start]

        self.state = allocate_state(self.world_count, self.hand_count, self.device)
        self.joint_torque = wp.zeros_like(self.state.hands.joint_q)
        self._layout = _state_layout(layouts[0])
        self._views = [
            wp.array(a.reshape(self.world_count, -1), dtype=wp.float64, device=self.device, copy=False)
            for a in (self._state, self._control, self._sensor)
        ]

    def step(self, apply_torques: Callable[[], None]) -> None:
        """Advance every world by one control step.

        Args:
            apply_torques: Called before every substep; fills ``joint_torque`` from ``state``.
        """
        state, (packed, control, sensor) = self.state, self._views
        hands = (self.world_count, self.hand_count)
        for substep in range(self.substeps):
            apply_torques()
            wp.launch(
                mujoco_state.pack_torques, hands, inputs=[self.joint_torque, self._layout, control], device=self.device
            )
            self._advance(self._control, self._next_state, self._sensor)
            wp.launch(
                mujoco_state.unpack_hands,
                hands,
                inputs=[packed, self._layout],
                outputs=[state.hands],
                device=self.device,
            )
            wp.launch(
                mujoco_state.accumulate_contact_force,
                hands,
                inputs=[sensor, self._layout, 1.0 / self.substeps, int(substep == 0)],
                outputs=[state.hands],
                device=self.device,
            )
        wp.launch(
            mujoco_state.unpack_object,
            self.world_count,
            inputs=[packed, self._layout],
            outputs=[state.objects, state.diverged],
            device=self.device,
        )

    def step_bare(self) -> None:
        """The bare physics of one control step: a single call with held torques (what `bench` divides by)."""
        shape = (self.world_count, self.substeps)
        control = np.repeat(self._control, self.substeps, axis=1)
        state = np.empty((*shape, self._state.shape[1]))
        sensor = np.empty((*shape, self._sensor.shape[2]))
        self._advance(control, state, sensor)

    def write_state(self, world_mask: wp.array) -> None:
        """Push ``state`` into the physics for the worlds whose mask (int, shape [world]) is not zero."""
        state, (packed, control, _) = self.state, self._views
        wp.launch(
            mujoco_state.pack_state,
            self.world_count,
            inputs=[world_mask, state.hands, state.objects, self._layout],
            outputs=[packed, control],
            device=self.device,
        )
        self._warmstart[world_mask.numpy() != 0] = 0.0

    def _advance(self, control: NDArray[np.float64], state: NDArray[np.float64], sensor: NDArray[np.float64]) -> None:
        step_count = control.shape[1]
        for rows, model, data in zip(self._slices, self.models, self._data, strict=True):
            self._rollout.rollout(
                [model] * (rows.stop - rows.start),
                data,
                self._state[rows],
                control[rows],
                control_spec=_CONTROL,
                skip_checks=True,
                nstep=step_count,
                initial_warmstart=self._warmstart[rows],
                state=state[rows],
                sensordata=sensor[rows],
            )
        # rollout keeps no warm start between calls; the velocity change is a close guess of the acceleration
        np.subtract(state[:, -1, self._qvel], self._state[:, self._qvel], out=self._warmstart)
        self._warmstart /= self._timestep * step_count
        self._state[:] = state[:, -1]


def _state_layout(layout: ModelLayout) -> mujoco_state.StateLayout:
    """The layout as columns of the packed rows, on the CPU device."""
    qvel, mocap_position = 1 + layout.qpos_count, layout.dof_count
    mocap_quaternion = mocap_position + 3 * layout.mocap_count
    columns = mujoco_state.StateLayout()
    hand_mocap = np.array(layout.hand_mocap, dtype=np.int32)
    columns.hand_qpos = wp.array(1 + layout.hand_qpos, dtype=int, device="cpu")
    columns.hand_qvel = wp.array(qvel + layout.hand_dof, dtype=int, device="cpu")
    columns.hand_force = wp.array(layout.hand_dof, dtype=int, device="cpu")
    columns.hand_mocap_position = wp.array(mocap_position + 3 * hand_mocap, dtype=int, device="cpu")
    columns.hand_mocap_quaternion = wp.array(mocap_quaternion + 4 * hand_mocap, dtype=int, device="cpu")
    columns.contact_sensor = wp.array(layout.contact_sensor, dtype=int, device="cpu")
    columns.hinge_qpos = 1 + layout.hinge_qpos
    columns.hinge_qvel = qvel + layout.hinge_dof
    free = layout.object_qpos >= 0
    columns.object_qpos = 1 + layout.object_qpos if free else -1
    columns.object_qvel = qvel + layout.object_dof if free else -1
    columns.object_mocap_position = -1 if free else mocap_position + 3 * layout.object_mocap
    columns.object_mocap_quaternion = -1 if free else mocap_quaternion + 4 * layout.object_mocap
    return columns
