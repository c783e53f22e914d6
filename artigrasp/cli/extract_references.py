"""`artigrasp extract-references`: raw recordings become references."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from artigrasp.cli.output import show, show_columns, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import ExtractionConfig
from artigrasp.errors import UserError
from artigrasp.files import check_folder, check_target

if TYPE_CHECKING:
    from artigrasp.assets.arctic import ArcticSource
    from artigrasp.references.extraction import Extractor
    from artigrasp.references.reference import ReferenceSet


@dataclass(frozen=True)
class Options:
    """Extract references from raw recordings of ARCTIC by the paper's rules.

    While hands hold the object and its base moves off the surface that it lies on, they grasp; while they touch the
    articulated part and the hinge angle changes, they articulate. One frame of each interaction becomes a reference in
    OUT/references/OBJECT.npz. Contacts are the recording's own, as in the ArtiGrasp release, or else measured between
    hand and object. Hands and objects must have been imported. To use what comes out, put OUT first among the folders
    of assets: ARTIGRASP_ASSETS=OUT:FOLDER artigrasp evaluate ...

    --plot draws what the rules see and find in one recording, with the frames that ArtiGrasp's authors picked where
    the copy has their labels, and writes nothing else.

    With --json: {"files": [file], "recordings": count, "references": {object: {split: {kind: count}}}}.
    """

    path: Annotated[Path, tyro.conf.Positional]
    """Folder of your copy: the official download or the ArtiGrasp release."""
    objects: tuple[str, ...] = ()
    """Objects whose recordings to read; all that were imported by default."""
    subjects: tuple[str, ...] = ()
    """Subjects whose recordings to read, as in s5; all by default."""
    reconstructed: bool = False
    """Take the hands from the release's reconstructions from images; the object moves as it was recorded."""
    contacts: Literal["given", "measured"] = "given"
    """Whether to use the contacts that recordings have, where they have some, or to measure them everywhere."""
    tasks: tuple[str, ...] = ("right_arti", "two_grasp", "right_grasp", "left_grasp")
    """What hands do in references: by default what they do in the paper's; there are left_arti and two_arti too."""
    rules: ExtractionConfig = field(default_factory=ExtractionConfig)
    """When a recording shows an interaction."""
    test_fraction: float = 0.35
    """Fraction of an object's references that are drawn for the split test."""
    seed: int = 0
    """Seed of that draw."""
    out: Path = Path("extracted")
    """Folder to write to."""
    overwrite: bool = False
    """Replace files that are there."""
    plot: str | None = None
    """Draw this recording, as in s1/box_use_01, into OUT."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Extract and write, or draw."""
    from artigrasp.assets.arctic import find_source

    source = find_source(options.path)
    check_folder(options.out)
    start_warp()
    from artigrasp.references.extracted_references import Selection, choose_recordings, extract_references
    from artigrasp.references.extraction import Extractor

    extractor = Extractor(source, options.rules, measure=options.contacts == "measured")
    selection = Selection(options.tasks, options.test_fraction, options.seed)
    if options.plot is not None:
        file = _plot(options, source, extractor, options.plot)
        _show([file], 1, {}, options.json)
        return 0
    recordings = choose_recordings(source, options.objects, options.subjects, reconstructed=options.reconstructed)
    with progress_bar("Extracting", hidden=options.json) as progress:
        written = extract_references(
            extractor, recordings, selection, options.out, overwrite=options.overwrite, progress=progress
        )
    counts = {each.object: _count(each) for each in written.values()}
    _show(list(written), sum(map(len, recordings.values())), counts, options.json)
    return 0


def _plot(options: Options, source: "ArcticSource", extractor: "Extractor", name: str) -> Path:
    from artigrasp.assets.object import load_object
    from artigrasp.references.agreement import pair_labels
    from artigrasp.references.arctic_labels import read_labels
    from artigrasp.references.arctic_sequence import Recording, check_name
    from artigrasp.references.interaction_plot import plot_interactions

    subject, _, sequence = name.partition("/")
    recording, object_name = Recording(subject, sequence, options.reconstructed), sequence.split("_")[0]
    try:
        check_name(recording, object_name)
    except ValueError as error:
        raise UserError(f"--plot {name}: expected a recording such as s1/box_use_01: {error}") from None
    file = options.out / f"{subject}_{sequence}{'_reconstructed' if options.reconstructed else ''}.png"
    check_target(file)
    extraction = extractor.extract(load_object(object_name), recording)
    pairs = pair_labels(extraction, read_labels(source, object_name), options.tasks, options.rules)
    plot_interactions(extraction, pairs, options.rules, file)
    return file


def _count(references: "ReferenceSet") -> dict[str, dict[str, int]]:
    counts: dict[str, Counter[str]] = {}
    for split, kind in zip(references.split.tolist(), references.kind.tolist(), strict=True):
        counts.setdefault(split, Counter())[kind] += 1
    return {split: dict(sorted(counts[split].items())) for split in sorted(counts)}


def _show(files: list[Path], recordings: int, counts: dict[str, dict[str, dict[str, int]]], as_json: bool) -> None:
    if as_json:
        show_json({"files": [str(file) for file in files], "recordings": recordings, "references": counts})
        return
    for file in files:
        show(f"wrote {file}")
    rows = [
        (f"  {name}", split, *(f"{kinds.get(kind, 0)} {kind}" for kind in ("articulate", "grasp")))
        for name, splits in counts.items()
        for split, kinds in splits.items()
    ]
    if rows:
        show_columns(rows)
    total = sum(sum(kinds.values()) for splits in counts.values() for kinds in splits.values())
    show(f"{total} references from {recordings} recordings")
