"""`artigrasp export-usd`: a motion file becomes a USD animation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json


@dataclass(frozen=True)
class Options:
    """Write a motion as a time-sampled USD stage with hands, object, hinge and ghosts.

    With --json: {"path": the USD file}.
    """

    motion: Annotated[Path, tyro.conf.Positional]
    """Motion file, as `artigrasp generate` writes it."""
    out: Path | None = None
    """USD file to write, .usdc, .usda or .usd; by default beside the motion, with the ending .usdc."""
    rate: float | None = None
    """Time codes per second; by default one per sample of the motion."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Convert the file."""
    from artigrasp.cli.warp_start import start_warp
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import load_motion

    start_warp()
    path = options.out or options.motion.with_suffix(".usdc")
    export_usd(load_motion(options.motion), path, rate=options.rate)
    if options.json:
        show_json({"path": str(path)})
    else:
        show(f"wrote {path}")
    return 0
