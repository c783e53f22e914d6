"""What throughput depends on besides the program."""

import importlib.metadata
import os
import platform
from pathlib import Path

import torch

PACKAGES = ("mujoco", "warp-lang", "newton", "torch", "rsl-rl-lib", "numpy")


def machine_facts() -> dict[str, str]:
    """Processor, cores, threads of the learner, and versions."""
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "learner threads": str(torch.get_num_threads()),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in PACKAGES},
    }


def _processor() -> str:
    """The processor's name, as far as the system tells."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
