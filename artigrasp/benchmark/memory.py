"""The most memory that was held since a moment, of the process or of a GPU."""

import ctypes
import gc
import resource
import sys
from pathlib import Path

import torch

_CLEAR_REFS, _STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


def forget_peak() -> None:
    """Give back what is not in use, and measure the process's peak from now on.

    Where the system does not offer that, the peak remains that of the process's life.
    """
    gc.collect()
    if sys.platform == "linux":
        # glibc keeps what was freed, as long as it is not told
        if (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)) is not None:
            trim(0)
        _CLEAR_REFS.write_text("5", encoding="ascii")


def memory_mb() -> float:
    """What the process holds now [MiB]; where the system does not tell, the most that it ever held."""
    return _process_memory_mb("VmRSS:")


def peak_memory_mb(device: str) -> float:
    """Most memory held since :func:`forget_peak` [MiB]: the process's for the CPU, else what is in use of the GPU.

    Memory of a GPU is held in pools that hardly shrink, so that what is in use now is about what was in use ever.
    """
    if torch.device(device).type == "cuda":
        free, total = torch.cuda.mem_get_info(torch.device(device))
        return float(total - free) / 2**20
    return _process_memory_mb("VmHWM:")


def _process_memory_mb(entry: str) -> float:
    """An entry of what Linux tells of the process, elsewhere the most that it ever held."""
    if sys.platform == "linux":
        for line in _STATUS.read_text(encoding="ascii").splitlines():
            if line.startswith(entry):
                return int(line.split()[1]) / 2**10
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10
