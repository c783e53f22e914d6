"""`artigrasp import-object`: a hinged object of a user's becomes an asset."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.errors import UserError
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Convert a hinged object in URDF or USD, and check what became of it; exit code 1 if it cannot be simulated.

    It must have one joint that turns, with limits; links that are fixed to each other count as one part. The limit
    nearer to 0 is the closed object. Concave shapes are cut into convex pieces, which takes up to a minute each, once.
    The result stands on z = 0. How to mend what is missing: docs/objects.md.

    With --json: {"path": file, "name": name, "usable": whether it can be simulated, "findings": as check-asset's}.
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The .urdf, .usd, .usda or .usdc file; meshes beside it, .obj, .stl, .ply or .glb."""
    name: str | None = None
    """What to call it: lower-case letters, digits and hyphens; by default as the file."""
    out: Path | None = None
    """File to write; by default where objects are looked for first, so that its name is known from then on."""
    root: Path | None = None
    """Folder that holds everything that the file refers to; by default its own, and nothing outside it is read."""
    density: float = 500.0
    """Of parts whose mass the file does not give [kg/m³]: 500 is wood, 1000 plastic or water."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Convert, check, and tell what is wrong."""
    from dataclasses import asdict

    from artigrasp.assets.check import check_asset
    from artigrasp.assets.imported_object import make_imported
    from artigrasp.assets.library import import_root
    from artigrasp.assets.object import write_object
    from artigrasp.assets.urdf_object import read_urdf_object
    from artigrasp.assets.usd_object import read_usd_object

    name = options.name or re.sub(r"[^a-z0-9]+", "-", options.file.stem.lower()).strip("-")
    if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) or name.startswith("open-"):
        raise UserError(f"name: expected lower-case letters, digits and hyphens, not 'open-' first, found {name!r}")
    if not 1 <= options.density <= 20000:
        raise UserError(f"density: expected 1 to 20000 kg/m³, found {options.density:g}")
    path = options.out or import_root() / "objects" / f"{name}.usda"
    if path.suffix != ".usda":
        raise UserError(f"{path}: expected a name that ends in .usda")
    check_target(path)
    if (suffix := options.file.suffix.lower()) not in (".urdf", ".usd", ".usda", ".usdc", ".usdz"):
        raise UserError(f"{options.file}: expected a .urdf, .usd, .usda or .usdc file")
    read = read_urdf_object if suffix == ".urdf" else read_usd_object
    with progress_bar("Importing", hidden=options.json) as progress:
        source = read(options.file, options.root)
        write_object(make_imported(source, name, path, density=options.density, progress=progress))
    report = check_asset(path)
    if options.json:
        findings = [asdict(finding) for finding in report.findings]
        show_json({"path": str(path), "name": name, "usable": report.usable, "findings": findings})
    else:
        for finding in report.findings:
            show(f"{finding.severity}: {finding.field}: {finding.problem}; {finding.remedy}")
        show(f"wrote {path}: {name} {'can' if report.usable else 'cannot'} be simulated")
    return 0 if report.usable else 1
