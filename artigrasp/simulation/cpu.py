"""The CPU backend: MuJoCo steps blocks of worlds on all cores."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import warp as wp

from artigrasp.kernels import mujoco_state
from artigrasp.simulation.launches import OnWorlds, launch_nothing
from artigrasp.simulation.mujoco_model import ModelLayout, compile_mujoco, model_layout
from artigrasp.simulation.scene import Scene, check_alike
from artigrasp.simulation.state import allocate_state
from artigrasp.simulation.world_block import CONTROL, PackedWorlds, WorldBlock, split_worlds


class CpuSimulation:
    """Worlds in contiguous slices, one slice and one compiled MuJoCo model per scene.

    Attributes:
        state: The batched state; write into it and call :meth:`write_state` to reset worlds.
        joint_torque: Joint torques [N, N·m] that the next substep applies, float32, shape [world, hand, 51].
        models: The compiled model of every scene.
        scene_rows: The worlds of every scene.
        torque_rows: Ranges of worlds that :meth:`step` asks torques for.
        packed: State, control, sensors and solver start of every world as MuJoCo keeps them.
    """

    device = "cpu"

    def __init__(self, scenes: Sequence[Scene], world_counts: Sequence[int], thread_count: int | None = None) -> None:
        """Compile the scenes and allocate the worlds.

        Args:
            scenes: Scenes that differ in nothing but their objects.
            world_counts: Worlds of each scene.
            thread_count: Threads that step the worlds, all cores by default.

        Raises:
            ValueError: The scenes differ in more than their objects.
        """
        check_alike(scenes)
        self.scenes = tuple(scenes)
        self.models = [compile_mujoco(scene) for scene in scenes]
        layouts = [model_layout(model, scene) for model, scene in zip(self.models, scenes, strict=True)]
        self.world_count = sum(world_counts)
        self.hand_count = len(scenes[0].hands)
        self.substeps = scenes[0].physics.substeps
        self.thread_count = thread_count or os.cpu_count() or 1
        ends = np.cumsum(world_counts).tolist()
        self.scene_rows = [slice(end - count, end) for end, count in zip(ends, world_counts, strict=True)]

        model = self.models[0]
        full_physics = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
        self.packed = PackedWorlds(
            state=np.zeros((self.world_count, mujoco.mj_stateSize(model, full_physics))),
            control=np.zeros((self.world_count, mujoco.mj_stateSize(model, CONTROL))),
            sensor=np.zeros((self.world_count, model.nsensordata)),
            warmstart=np.zeros((self.world_count, model.nv)),
        )
        for rows, compiled in zip(self.scene_rows, self.models, strict=True):
            initial = np.empty(self.packed.state.shape[1])
            mujoco.mj_getState(compiled, mujoco.MjData(compiled), initial, full_physics)
            self.packed.state[rows] = initial

        self.state = allocate_state(self.world_count, self.hand_count, len(scenes[0].objects), self.device)
        self.joint_torque = wp.zeros_like(self.state.hands.joint_q)
        self._layout = _state_layout(layouts[0])
        self._state_rows, self._control_rows = (
            wp.array(each, dtype=wp.float64, device=self.device, copy=False)
            for each in (self.packed.state, self.packed.control)
        )
        # More blocks launch more kernels, and balance the load where scenes differ in what they cost.
        block_count = self.thread_count * (1 if len(scenes) == 1 else 2)
        self._blocks = [
            WorldBlock(
                self.models[scene], rows, self.packed, self.state, self.joint_torque, self._layout, self.substeps
            )
            for scene, rows in split_worlds(world_counts, block_count)
        ]
        self.torque_rows = tuple(block.rows for block in self._blocks)
        # the calling thread steps blocks too
        self._helper_count = min(self.thread_count, len(self._blocks)) - 1
        self._helpers = ThreadPoolExecutor(max(self._helper_count, 1), thread_name_prefix="physics")

    def step(
        self, apply_torques: OnWorlds, begin: OnWorlds = launch_nothing, finish: OnWorlds = launch_nothing
    ) -> None:
        """Advance every world by one control step, see :meth:`artigrasp.simulation.backend.Simulation.step`."""
        self._share_out(lambda block: block.step(apply_torques, begin, finish))

    def launch(self, kernels: OnWorlds) -> None:
        """Launch kernels for every world, see :meth:`artigrasp.simulation.backend.Simulation.launch`."""
        self._share_out(lambda block: kernels(block.rows))

    def write_state(self, world_mask: wp.array) -> None:
        """Push ``state`` into the physics for the worlds whose mask (int, shape [world]) is not zero."""
        self.state.write_focus(world_mask)
        wp.launch(
            mujoco_state.pack_state,
            self.world_count,
            inputs=[world_mask, self.state.hands, self.state.slots, self._layout],
            outputs=[self._state_rows, self._control_rows],
            device=self.device,
        )
        self.packed.warmstart[world_mask.numpy() != 0] = 0.0

    def _share_out(self, work: Callable[[WorldBlock], None]) -> None:
        """Let all threads work until every block has been worked on."""
        blocks = iter(self._blocks)

        def work_on_blocks() -> None:
            for block in blocks:
                work(block)

        helpers = [self._helpers.submit(work_on_blocks) for _ in range(self._helper_count)]
        try:
            work_on_blocks()
        finally:
            for helper in helpers:
                helper.result()


def _state_layout(layout: ModelLayout) -> mujoco_state.StateLayout:
    """The layout as columns of the packed rows, on the CPU device."""
    qvel, mocap_position = 1 + layout.qpos_count, layout.dof_count
    mocap_quaternion = mocap_position + 3 * layout.mocap_count
    free = layout.object_qpos >= 0

    columns = mujoco_state.StateLayout()
    for name, values in {
        "hand_qpos": 1 + layout.hand_qpos,
        "hand_qvel": qvel + layout.hand_dof,
        "hand_force": layout.hand_dof,
        "hand_mocap_position": mocap_position + 3 * layout.hand_mocap,
        "hand_mocap_quaternion": mocap_quaternion + 4 * layout.hand_mocap,
        "hinge_qpos": 1 + layout.hinge_qpos,
        "hinge_qvel": qvel + layout.hinge_dof,
        "object_qpos": np.where(free, 1 + layout.object_qpos, -1),
        "object_qvel": np.where(free, qvel + layout.object_dof, -1),
        "object_mocap_position": np.where(free, -1, mocap_position + 3 * layout.object_mocap),
        "object_mocap_quaternion": np.where(free, -1, mocap_quaternion + 4 * layout.object_mocap),
        "contact_sensor": layout.contact_sensor,
    }.items():
        setattr(columns, name, wp.array(values, dtype=int, device="cpu"))
    return columns
