"""`artigrasp synthesize-references`: references of any hinged object, without recordings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from typing import Annotated, Any, Literal

import tyro

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig, SynthesisConfig, to_dict
from artigrasp.errors import UserError
from artigrasp.files import check_target

GripName = Literal["articulate-right", "articulate-left", "grasp-both", "grasp-right", "grasp-left"]
OPEN_HAND = "open"
SHARES = 1000
"""Steps of the progress bar for each kind."""
COLUMNS = (
    *("object", "kind", "fitted", "sound", "tried", "PD+IK", "search", "kept", "s each", "deepest mm", "contacts"),
)
"""Of the table."""


@dataclass(frozen=True)
class Options:
    """Synthesise references of objects without recordings, and keep those that work in simulation.

    Hands are fitted to the object as it rests on the table, closed, from many starts at once; of the sound ones that
    differ, those are kept with which PD+IK, or else a short search, opens the free object or lifts it. Writes
    OUT/references/OBJECT.npz, in the splits train and test, after every kind. What the file has already of kinds made
    with the same settings is not made again. On an object that is its own mirror image, what one hand does the other
    does in the mirror, and is tried again. To use the references, put OUT first among the folders of assets:
    ARTIGRASP_ASSETS=OUT:FOLDER artigrasp evaluate articulation ...

    With --json: {"files": [file], "objects": {object: {kind: {"fitted", "sound", "tried", "pd_ik", "search", "kept",
    "seconds", "deepest_mm": median or null, "contacts": mean or null}}}}.
    """

    objects: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Objects, as `artigrasp list objects` names them."""
    kinds: tuple[GripName, ...] = ("articulate-right", "articulate-left", "grasp-both", "grasp-right", "grasp-left")
    """Kinds of references."""
    count: int = 8
    """References of each kind, at most."""
    hand: str | None = None
    """Hand; by default that of the object's references, or the open hand."""
    out: Path = Path("synthesised")
    """Folder to write to."""
    untested: bool = False
    """Keep sound grips that differ without trying them in simulation: many to train on, of which some cannot work."""
    overwrite: bool = False
    """Begin anew where files were made with other settings."""
    synthesis: SynthesisConfig = field(default_factory=SynthesisConfig)
    """How many hands are tried, and what weighs what."""
    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    """Where the physics runs."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Synthesise, write and tell how many hands came how far."""
    from artigrasp.assets.object import load_object

    if not options.objects:
        raise UserError("objects: expected at least one, found none")
    if options.count < 1:
        raise UserError(f"count: expected a positive number, found {options.count}")
    files = {name: options.out / "references" / f"{name}.npz" for name in dict.fromkeys(options.objects)}
    for name, file in files.items():
        load_object(name)
        check_target(file)
    start_warp()
    made = {}
    total = len(files) * len(options.kinds)
    with progress_bar("Synthesising", hidden=options.json) as progress:
        for index, (name, file) in enumerate(files.items()):

            def on_share(stage: str, share: float, index: int = index, name: str = name) -> None:
                done = index * len(options.kinds) + share
                progress(f"{name} {stage}", int(SHARES * done), SHARES * total)

            made[name] = _make(name, file, options, on_share)
    _show(made, [file for file in files.values() if file.is_file()], options.json)
    return 0


def _make(name: str, file: Path, options: Options, on_share: Callable[[str, float], None]) -> dict[str, Any]:
    """Make what a file lacks; what it says then of each kind."""
    from artigrasp.assets.hand import load_hand
    from artigrasp.assets.object import load_object
    from artigrasp.evaluation.synthesis import mirror_synthesized, synthesize_references
    from artigrasp.evaluation.synthesis_file import SynthesisFile
    from artigrasp.kernels.layout import HANDS
    from artigrasp.references.natural_pose import recorded_natural_pose
    from artigrasp.references.synthesis.grip import GRIPS, rest, usual_pose
    from artigrasp.references.synthesis.mirror import find_mirror_plane

    pose, usual_hand = usual_pose(name)
    hand = options.hand or usual_hand or OPEN_HAND
    hands = (load_hand(hand, HANDS[0]), load_hand(hand, HANDS[1]))
    settings = {"settings": to_dict(options.synthesis), "count": options.count, "hand": hand}
    if options.untested:
        settings["untested"] = True
    target = SynthesisFile(file, settings, overwrite=options.overwrite)
    resting, natural = rest(load_object(name), pose), recorded_natural_pose(hand)
    plane = find_mirror_plane(resting)
    for index, kind in enumerate(options.kinds):
        if kind in target.grips:
            continue

        def on_stage(stage: str, share: float, index: int = index, kind: str = kind) -> None:
            on_share(f"{kind}: {stage}", index + share)

        grip = GRIPS[kind]
        other = target.made_of(grip.mirrored)
        if plane is not None and other is not None and not options.untested:
            made = mirror_synthesized(*other, plane, options.synthesis, simulator=options.simulator, on_stage=on_stage)
        else:
            made = synthesize_references(
                grip,
                resting,
                hands,
                natural,
                options.synthesis,
                count=options.count,
                untested=options.untested,
                simulator=options.simulator,
                on_stage=on_stage,
            )
        target.add(kind, made)
    return {kind: _measures(target.grips[kind]) for kind in options.kinds}


def _measures(grip: dict[str, Any]) -> dict[str, Any]:
    """Of one kind: how many hands came how far, and how those that were kept touch."""
    count, records = grip["count"], grip["references"]
    depths, contacts = ([each[name] for each in records] for name in ("deepest", "contacts"))
    return {
        **count,
        "kept": len(records),
        "deepest_mm": 1000 * median(depths) if depths else None,
        "contacts": mean(contacts) if contacts else None,
    }


def _show(made: dict[str, dict[str, Any]], files: list[Path], as_json: bool) -> None:
    if as_json:
        show_json({"files": [str(file) for file in files], "objects": made})
        return
    table: list[tuple[str, ...]] = [COLUMNS]
    for name, kinds in made.items():
        for kind, row in kinds.items():
            counts = [str(row[key]) for key in ("fitted", "sound", "tried", "pd_ik", "search", "kept")]
            each = f"{row['seconds'] / row['kept']:.0f}" if row["kept"] else ""
            depth = f"{row['deepest_mm']:.2f}" if row["kept"] else ""
            contacts = f"{row['contacts']:.1f}" if row["kept"] else ""
            table.append((name, kind, *counts, each, depth, contacts))
    show_columns(table)
    for file in files:
        show(f"wrote {file}")
