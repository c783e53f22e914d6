"""`artigrasp import-arctic`: a user's own copy of the data becomes assets."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar


@dataclass(frozen=True)
class Options:
    """Convert your copy of ARCTIC to hands, objects and references.

    Known layouts are the official download (meta/object_vtemplates/ and raw_seqs/, which has objects but neither hands
    nor labelled frames), the ArtiGrasp authors' release (rsc/), and labelled_frames.npz, alone or in one of these
    folders, which gives references of objects that were imported before.

    ARCTIC and MANO are licensed to each user: what is written stays on this machine, out of version control and out of
    packages. Cutting the meshes into convex collision pieces takes up to a minute each, once; an interrupted import is
    taken up where it was, and files that were made of the same data before are left alone.

    With --json: {"destination": folder, "written": [file], "unchanged": [file], "skipped": [what and why], "parts":
    {object: {part: {"pieces", "open_edges": edges of the mesh that are not shared by two faces, "volume_ratio": union
    of the pieces to mesh, "outward_median_mm" and "outward_p95_mm": distance from the surface of the pieces to that of
    the mesh, "inward_median_mm" and "inward_p95_mm": from the mesh to the pieces}}}}.
    """

    path: Annotated[Path, tyro.conf.Positional]
    """Folder of your copy, or labelled_frames.npz."""
    mano: Path | None = None
    """MANO_RIGHT.pkl, MANO_LEFT.pkl or their folder, to make the hands of instead of the release's."""
    objects: tuple[str, ...] = ()
    """Objects to import; all by default."""
    destination: Path | None = None
    """Folder to write to; by default where objects are looked for first."""
    processes: int | None = None
    """Largest number of meshes to cut at a time; by default as many as there are processors."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Import, and tell what was written."""
    from artigrasp.references.arctic import import_arctic

    with progress_bar("Importing", hidden=options.json) as progress:
        report = import_arctic(
            options.path,
            options.objects or None,
            options.destination,
            progress,
            mano=options.mano,
            processes=options.processes,
        )
    if options.json:
        show_json(asdict(report) | {"destination": str(report.destination)})
        return 0
    for name in report.written:
        show(f"wrote {report.destination / name}")
    for reason in report.skipped:
        show(f"skipped {reason}")
    if report.parts:
        show("Collision pieces, and how far [mm] their surface is from the mesh, and the mesh from it:")
        head = ("  object", "part", "pieces", "volume ratio", "median", "95 %", "median", "95 %", "open edges")
        show_columns([head, *_rows(report.parts)])
    show(f"{len(report.written)} files written, {len(report.unchanged)} unchanged, {len(report.skipped)} notes")
    return 0


def _rows(parts: dict[str, dict[str, dict[str, float]]]) -> list[tuple[str, ...]]:
    distances = [f"{direction}_{figure}_mm" for direction in ("outward", "inward") for figure in ("median", "p95")]
    return [
        (
            f"  {name}",
            part,
            str(fit["pieces"]),
            f"{fit['volume_ratio']:.3f}",
            *(f"{fit[distance]:.2f}" for distance in distances),
            str(fit["open_edges"]),
        )
        for name, both in parts.items()
        for part, fit in both.items()
    ]
