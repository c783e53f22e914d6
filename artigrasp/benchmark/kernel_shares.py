"""Where the time of a control step goes: MuJoCo, each kernel, and the rest."""

import contextlib
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import warp as wp
from mujoco.rollout import Rollout

from artigrasp.simulation.newton import NewtonSimulation

PHYSICS = "MuJoCo"
REST = "everything else"
"""Launching, Python, and handing over between threads."""


@dataclass(frozen=True)
class TimeShare:
    """What one kernel takes of a control step."""

    name: str
    calls: float
    """Calls per control step, over all blocks of worlds."""
    time: float
    """Processor time per control step, over all threads, or time on the GPU [s]."""
    share: float
    """Fraction of the control step's time."""


def time_shares(step: Callable[[], None], step_count: int, prepare: Callable[[int], None]) -> list[TimeShare]:
    """Measure processor time, which does not depend on what else the machine does.

    Launches on the CPU device return when the kernel is done, so that the clock of the launching thread tells what the
    launch took, the packing of its arguments included.

    Args:
        step: One control step.
        step_count: Control steps to measure.
        prepare: Called with 0, 1, ... before each of them; not measured, and launches nothing.

    Returns:
        The longest first; what is left over last.
    """
    calls: list[tuple[str, float]] = []
    total = 0.0
    with _timed_calls(calls):
        for index in range(step_count):
            prepare(index)
            start = time.process_time()
            step()
            total += time.process_time() - start
    times: dict[str, list[float]] = defaultdict(list)
    for name, seconds in calls:
        times[name].append(seconds)
    shares = [
        TimeShare(name, len(each) / step_count, sum(each) / step_count, sum(each) / total)
        for name, each in times.items()
    ]
    shares.sort(key=lambda share: -share.share)
    rest = total - sum(map(sum, times.values()))
    return [*shares, TimeShare(REST, 0.0, rest / step_count, rest / total)]


def device_time_shares(simulation: NewtonSimulation, step: Callable[[], None], step_count: int) -> list[TimeShare]:
    """Time on a GPU, without replaying graphs, for a graph is timed as a whole.

    Args:
        simulation: What the step steps.
        step: One control step.
        step_count: Control steps to measure.

    Returns:
        The longest first.
    """
    times: dict[str, list[float]] = defaultdict(list)
    with simulation.without_replay():
        wp.timing_begin(cuda_filter=wp.TIMING_KERNEL)
        for _ in range(step_count):
            step()
        for result in wp.timing_end():
            times[result.name].append(result.elapsed * 1e-3)
    total = sum(map(sum, times.values()))
    shares = [
        TimeShare(name, len(each) / step_count, sum(each) / step_count, sum(each) / total)
        for name, each in times.items()
    ]
    return sorted(shares, key=lambda share: -share.share)


@contextlib.contextmanager
def _timed_calls(calls: list[tuple[str, float]]) -> Iterator[None]:
    """Append the name and the processor time [s] of every launch and rollout to ``calls``, from any thread."""
    originals = (wp.launch, wp.Launch.launch, Rollout.rollout)

    def timed(call: Callable[..., Any], name_of: Callable[[Any], str]) -> Callable[..., Any]:
        def timed_call(subject: Any, *args: Any, **options: Any) -> Any:
            start = time.thread_time()
            result = call(subject, *args, **options)
            calls.append((name_of(subject), time.thread_time() - start))
            return result

        return timed_call

    try:
        wp.launch = timed(wp.launch, lambda kernel: str(kernel.key))
        wp.Launch.launch = timed(wp.Launch.launch, lambda launch: str(launch.kernel.key))
        Rollout.rollout = timed(Rollout.rollout, lambda rollout: PHYSICS)
        yield
    finally:
        wp.launch, wp.Launch.launch, Rollout.rollout = originals
