"""What every physics backend offers, and the choice between them."""

from collections.abc import Sequence
from typing import Protocol

import warp as wp

from artigrasp.errors import UserError, unknown
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.launches import OnWorlds, launch_nothing
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.simulation.scene import Scene
from artigrasp.simulation.state import SimulationState

BACKENDS = ("cpu", "mjwarp")
"""MuJoCo on all cores; MuJoCo Warp through Newton, meant for GPUs."""

PACKAGES = ("newton", "mujoco", "warp-lang")
"""Whose versions the numbers depend on."""


class Simulation(Protocol):
    """Worlds of one or more scenes, stepped together; the worlds of a scene stand side by side."""

    @property
    def device(self) -> str:
        """Warp device of every array."""

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """What the worlds are copies of."""

    @property
    def world_count(self) -> int:
        """Worlds of all scenes together."""

    @property
    def hand_count(self) -> int:
        """Hands in each world."""

    @property
    def substeps(self) -> int:
        """Simulation steps per control step."""

    @property
    def state(self) -> SimulationState:
        """The state after the last control step; write into it and call :meth:`write_state` to reset worlds."""

    @property
    def joint_torque(self) -> wp.array:
        """Joint torques [N, N·m] that the next substep applies, float32, shape [world, hand, 51]."""

    @property
    def torque_rows(self) -> tuple[slice, ...]:
        """Ranges of worlds that :meth:`step` asks torques for."""

    def step(
        self, apply_torques: OnWorlds, begin: OnWorlds = launch_nothing, finish: OnWorlds = launch_nothing
    ) -> None:
        """Advance every world by one control step.

        What is called here is called with one of ``torque_rows``, from several threads at a time. It may do nothing but
        launch kernels for these worlds, with the same arguments every time, for a backend may record and replay them.

        Args:
            apply_torques: Called before every substep; fills ``joint_torque`` from ``state``.
            begin: Called before the first substep.
            finish: Called after the last, when ``state`` is that after the step.
        """

    def launch(self, kernels: OnWorlds) -> None:
        """Launch kernels for every world, on the threads that step them.

        Args:
            kernels: Called with each of ``torque_rows``, from several threads at a time.
        """

    def write_state(self, world_mask: wp.array) -> None:
        """Push ``state`` into the physics for the worlds whose mask (int, shape [world]) is not zero.

        Of the object in focus it is ``state.objects`` that counts, of the others ``state.slots``.
        """


def make_simulation(
    backend: str,
    scenes: Sequence[Scene],
    world_counts: Sequence[int],
    *,
    thread_count: int | None = None,
    device: str | None = None,
) -> Simulation:
    """Compile scenes for a backend.

    Args:
        backend: One of ``BACKENDS``.
        scenes: Scenes that differ in nothing but their objects.
        world_counts: Worlds of each scene.
        thread_count: Threads of the cpu backend, all cores by default.
        device: Warp device of the mjwarp backend, by default the first GPU, or the CPU where there is none.

    Raises:
        UserError: There is no such backend or device.
    """
    if backend == "cpu":
        if device not in (None, CpuSimulation.device):
            raise UserError(f"device: expected {CpuSimulation.device} for the backend cpu, found {device!r}")
        return CpuSimulation(scenes, world_counts, thread_count)
    if backend == "mjwarp":
        return NewtonSimulation(scenes, world_counts, device or ("cuda:0" if wp.is_cuda_available() else "cpu"))
    raise unknown("backend", backend, BACKENDS)
