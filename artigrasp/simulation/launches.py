"""Launches of kernels: for ranges of worlds, and recorded."""

from collections.abc import Callable
from typing import Any

import warp as wp

OnWorlds = Callable[[slice], None]
"""Launches kernels for a range of worlds."""


def launch_nothing(worlds: slice) -> None:
    """What a control step that needs only torques has at its beginning and its end."""


def record(kernel: wp.Kernel, dim: int | tuple[int, ...], arguments: list[Any], device: str) -> wp.Launch:
    """A launch whose arguments stay the same: packing them anew would take longer than most kernels run."""
    return wp.launch(kernel, dim, inputs=arguments, device=device, record_cmd=True)
