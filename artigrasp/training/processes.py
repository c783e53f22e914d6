"""Several processes that train together, as `torchrun` starts them; without it, the only one."""

import contextlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import distributed

from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.evaluation.chunks import Shard

_SEED_STRIDE = 1_000_003
"""Between the seeds of one process and the next."""


@dataclass(frozen=True)
class Processes(Shard):
    """Which of how many processes this is.

    Every process simulates its share of the worlds. Their gradients are averaged, so that together they learn as one
    process with all worlds would.
    """

    @property
    def rsl_rl_settings(self) -> dict[str, int] | None:
        """What rsl-rl's PPO wants to know."""
        if self.count == 1:
            return None
        return {"global_rank": self.rank, "local_rank": self.rank, "world_size": self.count}

    def own_seed(self, seed: int) -> int:
        """A seed of this process's own; the first one keeps the common seed."""
        return seed + self.rank * _SEED_STRIDE

    def share(self, worlds: int) -> int:
        """This process's share of the worlds.

        Raises:
            UserError: They do not divide, so that processes would count differently.
        """
        if worlds % self.count != 0:
            raise UserError(f"worlds: expected a multiple of the number of processes ({self.count}), found {worlds}")
        return worlds // self.count

    def gather(self, value: Any) -> list[Any]:
        """What each process has, in their order; all must ask at the same time."""
        if self.count == 1:
            return [value]
        values: list[Any] = [None] * self.count
        distributed.all_gather_object(values, value)
        return values

    def normalize(self, values: torch.Tensor) -> torch.Tensor:
        """Values less their mean, over their standard deviation, both of all processes; each has as many."""
        if self.count == 1:
            return (values - values.mean()) / (values.std() + 1e-8)
        total = torch.stack([values.sum(), torch.tensor(float(values.numel()), device=values.device)]).double()
        distributed.all_reduce(total)
        mean = (total[0] / total[1]).to(values)
        squares = (values - mean).square().sum().double()
        distributed.all_reduce(squares)
        deviation = (squares / (total[1] - 1.0)).sqrt().to(values)
        return (values - mean) / (deviation + 1e-8)


ALONE = Processes()
"""One process that trains by itself."""


@contextlib.contextmanager
def joined_processes(simulator: SimulatorConfig) -> Iterator[tuple[Processes, SimulatorConfig]]:
    """Join the processes that `torchrun` started.

    They talk by NCCL where each has a GPU, else by gloo; rsl-rl's own runner knows only the former.

    Args:
        simulator: What all of them were asked to simulate on.

    Yields:
        The processes, and what this one simulates on: a GPU of its own with the backend mjwarp where there are GPUs,
        else its share of the cores.
    """
    processes = Processes.from_environment()
    if processes.count == 1:
        yield processes, simulator
        return
    has_gpu = simulator.backend == "mjwarp" and simulator.device is None and torch.cuda.is_available()
    if has_gpu:
        simulator = replace(simulator, device=f"cuda:{os.environ.get('LOCAL_RANK', 0)}")
        torch.cuda.set_device(torch.device(str(simulator.device)))
    local_count = int(os.environ.get("LOCAL_WORLD_SIZE", processes.count))
    threads = simulator.threads or max((os.cpu_count() or 1) // local_count, 1)
    distributed.init_process_group("nccl" if has_gpu else "gloo")
    try:
        yield processes, replace(simulator, threads=threads)
    finally:
        distributed.destroy_process_group()


def mean_of(totals: list[Mapping[str, tuple[float, int]]]) -> dict[str, float]:
    """Means over all processes of what each has summed and counted; what nobody counted is left out."""
    names = dict.fromkeys(name for each in totals for name in each)
    means = {}
    for name in names:
        sums, counts = zip(*(each[name] for each in totals if name in each), strict=True)
        if sum(counts):
            means[name] = sum(sums) / sum(counts)
    return means
