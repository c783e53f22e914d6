"""`artigrasp export-mano`: the hands of a motion file become MANO's parameters."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Write the hands of a motion as MANO's parameters, to be skinned with your own copy of MANO.

    The .npz holds left_ and right_ global_orient, hand_pose, transl and betas, as smplx takes them.

    With --json: {"path": the file}.
    """

    motion: Annotated[Path, tyro.conf.Positional]
    """Motion file, as `artigrasp generate` writes it."""
    out: Path | None = None
    """File to write; by default beside the motion, with the ending .mano.npz."""
    mean_pose: bool = False
    """Leave MANO's mean pose out of hand_pose, as smplx expects unless it is told flat_hand_mean=True. Needs the hands
    that `import-arctic` makes."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Convert the file."""
    from artigrasp.assets.arctic_hand import load_mean_pose, mean_pose_path
    from artigrasp.assets.library import import_root
    from artigrasp.motion.file import load_motion
    from artigrasp.motion.mano import export_mano

    path = options.out or options.motion.with_suffix(".mano.npz")
    check_target(path)
    motion = load_motion(options.motion)
    mean_pose = load_mean_pose(mean_pose_path(import_root())) if options.mean_pose else None
    export_mano(motion, path, mean_pose=mean_pose)
    if options.json:
        show_json({"path": str(path)})
    else:
        show(f"wrote {path}")
    return 0
