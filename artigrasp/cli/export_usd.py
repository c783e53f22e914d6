"""`artigrasp export-usd`: motion files become a USD animation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Write a motion, or several side by side, as a time-sampled USD stage with hands, objects, hinges and ghosts.

    With --json: {"path": the USD file}.
    """

    motions: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Motion files, as `artigrasp generate` writes them."""
    out: Path | None = None
    """USD file to write, .usdc, .usda or .usd; by default beside the first motion, with the ending .usdc."""
    rate: float | None = None
    """Time codes per second, at each of which the motion is sampled; by default its own samples are written."""
    hands: Literal["skinned", "baked", "links"] = "skinned"
    """Hands as UsdSkel characters; as meshes whose points move, for programs that know no UsdSkel; or as the rigid
    links that collide."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Convert the files."""
    from artigrasp.cli.warp_start import start_warp
    from artigrasp.errors import UserError
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import load_motion

    if not options.motions:
        raise UserError("expected one or more motion files, found none")
    path = options.out or options.motions[0].with_suffix(".usdc")
    check_target(path)
    start_warp()
    export_usd([load_motion(motion) for motion in options.motions], path, rate=options.rate, hands=options.hands)
    if options.json:
        show_json({"path": str(path)})
    else:
        show(f"wrote {path}")
    return 0
