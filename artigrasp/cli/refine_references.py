"""`artigrasp refine-references`: fingers out of the object and onto it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import RefinementConfig
from artigrasp.errors import UserError
from artigrasp.files import check_target

if TYPE_CHECKING:
    from artigrasp.references.reference import ReferenceSet

MEASURES = {
    "deepest_mm": "deepest point in the object",
    "mean_depth_mm": "depth, mean over links",
    "missing_contacts": "target contacts missed",
    "beyond_limits_rad": "beyond joint limits",
}
"""What is measured before and afterwards, in the words of the table."""
CHANGES = {"moved_mm": "wrist moved", "turned_rad": "wrist turned", "bent_rad": "fingers bent"}


@dataclass(frozen=True)
class Options:
    """Refine noisy references: fingers come out of the object and onto it, near the pose that they had.

    Writes OUT/references/OBJECT.npz with all references that the object has and the refined ones in splits of their
    own, recon-refined for recon. To use them, put OUT first among the folders of assets:
    ARTIGRASP_ASSETS=OUT:FOLDER artigrasp evaluate articulation --split recon-refined ...

    Depths and contacts are those of the hand's collision shapes and the object's surface at its initial hinge angle; a
    link touches within 5 mm. Figures are means over references with their 95 % intervals.

    With --json: {"files": [file], "references": count, "target_contacts": mean, "before" and "after": {measure:
    {"value", "low", "high", "trials", "largest"}}, "change": likewise, "per_reference": [{"object", "source", "split",
    "kind", measure and change: number}]}; measures of one reference are pairs of before and after.
    """

    objects: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Objects whose references to refine."""
    split: str | None = None
    """Split to refine; by default all that is not refined already."""
    out: Path = Path("refined")
    """Folder to write to."""
    refinement: RefinementConfig = field(default_factory=RefinementConfig)
    """Weights and scales."""
    device: str = "cpu"
    """Warp device."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Refine, write and tell how the references have changed."""
    from artigrasp.assets.hand import load_hand
    from artigrasp.assets.library import find_asset
    from artigrasp.assets.object import load_object
    from artigrasp.kernels.layout import HANDS
    from artigrasp.references.reference import load_references, save_references

    if not options.objects:
        raise UserError("objects: expected at least one, found none")
    sets = {name: load_references(name) for name in dict.fromkeys(options.objects)}
    chosen = {name: _choose(references, options.split) for name, references in sets.items()}
    files = {name: options.out / "references" / f"{name}.npz" for name in sets}
    for name, file in files.items():
        if file.resolve() == find_asset("references", name).resolve():
            raise UserError(f"{file}: these are the references to refine: choose another folder with --out")
        check_target(file)

    start_warp()
    import warp as wp

    from artigrasp.references.natural_pose import gather_natural_pose
    from artigrasp.references.quality import measure_contacts
    from artigrasp.references.refinement import refine_references, with_refined

    if options.device not in (known := [device.alias for device in wp.get_devices()]):
        raise UserError(f"device: expected one of {', '.join(known)}, found {options.device!r}")
    rows: list[dict[str, Any]] = []
    total = options.refinement.iterations * len(sets)
    with progress_bar("Refining", hidden=options.json) as progress:
        for index, (name, references) in enumerate(chosen.items()):
            model = load_object(name)
            hands = (load_hand(references.hand, HANDS[0]), load_hand(references.hand, HANDS[1]))
            first = options.refinement.iterations * index
            result = refine_references(
                references,
                model,
                hands,
                gather_natural_pose(references.hand),
                options.refinement,
                device=options.device,
                on_iteration=lambda done, name=name, first=first: progress(name, first + done, total),  # type: ignore[misc]
            )
            save_references(files[name], with_refined(sets[name], result.references, options.refinement))
            before, after = (
                measure_contacts(each, model, hands, options.device) for each in (references, result.references)
            )
            for row in range(len(references)):
                rows.append(
                    {
                        "object": name,
                        "source": str(references.source[row]),
                        "split": str(references.split[row]),
                        "kind": str(references.kind[row]),
                        "target_contacts": int(before.target_contacts[row]),
                        "deepest_mm": [1000 * float(each.deepest[row]) for each in (before, after)],
                        "mean_depth_mm": [1000 * float(each.mean_depth[row]) for each in (before, after)],
                        "missing_contacts": [int(each.missing_contacts[row]) for each in (before, after)],
                        "beyond_limits_rad": [float(each.beyond_limits[row]) for each in (before, after)],
                        "moved_mm": 1000 * float(result.moved[row]),
                        "turned_rad": float(result.turned[row]),
                        "bent_rad": float(result.bent[row]),
                    }
                )
    _show(rows, list(files.values()), options.json)
    return 0


def _choose(references: "ReferenceSet", split: str | None) -> "ReferenceSet":
    if split is not None:
        return references.select(split=split)
    from artigrasp.references.refinement import is_refined

    return references.select(indices=[row for row in range(len(references)) if not is_refined(references.split[row])])


def _show(rows: list[dict[str, Any]], files: list[Path], as_json: bool) -> None:
    summary = {
        moment: {name: _summarize([row[name][index] for row in rows]) for name in MEASURES}
        for index, moment in enumerate(("before", "after"))
    }
    change = {name: _summarize([row[name] for row in rows]) for name in CHANGES}
    target_contacts = sum(row["target_contacts"] for row in rows) / len(rows)
    if as_json:
        head = {"files": [str(file) for file in files], "references": len(rows), "target_contacts": target_contacts}
        show_json({**head, **summary, "change": change, "per_reference": rows})
        return
    show(f"{len(rows)} references with {target_contacts:.1f} target contacts on average:")
    table: list[tuple[str, ...]] = [("", "before", "after", "largest before", "largest after")]
    for name, words in MEASURES.items():
        unit = _unit(name)
        before, after = summary["before"][name], summary["after"][name]
        largest = (f"{each['largest']:.3g}" for each in (before, after))
        table.append((f"  {words}{unit}", _interval(before), _interval(after), *largest))
    for name, words in CHANGES.items():
        table.append((f"  {words}{_unit(name)}", "", _interval(change[name]), "", f"{change[name]['largest']:.3g}"))
    show_columns(table)
    for file in files:
        show(f"wrote {file}")


def _summarize(values: list[float]) -> dict[str, Any]:
    from artigrasp.evaluation.statistics import estimate_mean

    estimate = estimate_mean(values, range(len(values)))
    return {**vars(estimate), "largest": float(max(values))}


def _interval(estimate: dict[str, Any]) -> str:
    if estimate["low"] is None:
        return f"{estimate['value']:.3g}"
    return f"{estimate['value']:.3g} [{estimate['low']:.3g}, {estimate['high']:.3g}]"


def _unit(name: str) -> str:
    return f" [{name.rsplit('_', 1)[1]}]" if name.endswith(("_mm", "_rad")) else ""
