"""`artigrasp import-arctic`: a user's own copy of the data becomes assets."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar


@dataclass(frozen=True)
class Options:
    """Convert your copy of the ArtiGrasp release to hands, objects and references.

    ARCTIC and MANO are licensed to each user: what is written stays on this machine, out of version control and out of
    packages. Files that were made of the same data before are left alone.

    With --json: {"destination": folder, "written": [file], "unchanged": [file], "skipped": [label and reason]}.
    """

    path: Annotated[Path, tyro.conf.Positional]
    """Folder that holds rsc/ and labelled_frames.npz."""
    objects: tuple[str, ...] = ()
    """Objects to import; all by default."""
    destination: Path | None = None
    """Folder to write to; by default where objects are looked for first."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Import, and tell what was written."""
    from artigrasp.references.arctic import import_arctic

    with progress_bar("Importing", hidden=options.json) as progress:
        report = import_arctic(options.path, options.objects or None, options.destination, progress)
    if options.json:
        show_json(
            {
                "destination": str(report.destination),
                "written": report.written,
                "unchanged": report.unchanged,
                "skipped": report.skipped,
            }
        )
        return 0
    for name in report.written:
        show(f"wrote {report.destination / name}")
    for reason in report.skipped:
        show(f"skipped {reason}")
    show(
        f"{len(report.written)} files written, {len(report.unchanged)} unchanged, {len(report.skipped)} labels skipped"
    )
    return 0
