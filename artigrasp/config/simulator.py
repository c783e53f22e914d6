"""Where a task is simulated: nothing that a task means, and nothing that a run keeps."""

from dataclasses import dataclass
from typing import Literal

from artigrasp.config.checks import require_positive


@dataclass(frozen=True)
class SimulatorConfig:
    """Backend, device and threads; the verbs of the command line that simulate have these options."""

    backend: Literal["cpu", "mjwarp"] = "cpu"
    """Physics: cpu is MuJoCo on all cores, mjwarp is MuJoCo Warp, which is meant for GPUs."""
    device: str | None = None
    """Device of the backend mjwarp, such as cuda:0; by default the first GPU, or cpu where there is none."""
    threads: int | None = None
    """Threads of the backend cpu, and of the learner while the physics rests; by default one per core."""

    def __post_init__(self) -> None:
        if self.threads is not None:
            require_positive(self, "threads")
