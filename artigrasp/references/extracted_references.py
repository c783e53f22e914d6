"""References of what extraction found in recordings."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from artigrasp.assets.arctic import ArcticSource
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.errors import UserError, unknown
from artigrasp.files import check_target
from artigrasp.references.arctic_labels import IMAGES, Label, LabelledFrame
from artigrasp.references.arctic_references import TASKS, make_references
from artigrasp.references.arctic_sequence import Recording, find_recordings
from artigrasp.references.extraction import Extraction, Extractor
from artigrasp.references.interactions import Interaction
from artigrasp.references.reference import ReferenceSet, describe_provenance, save_references
from artigrasp.references.splits import PARTED

PAPER_TASKS = ("right_arti", "two_grasp", "right_grasp", "left_grasp")
"""What hands do in the paper's references: left hands and both together articulate too, but not there."""
TEST_FRACTION = 0.35
"""The paper's."""


@dataclass(frozen=True)
class Selection:
    """Which interactions become references, and of which split.

    Attributes:
        tasks: What the hands do.
        test_fraction: Fraction of an object's references that are for the test.
        seed: Of the draw of them.
    """

    tasks: tuple[str, ...] = PAPER_TASKS
    test_fraction: float = TEST_FRACTION
    seed: int = 0

    def __post_init__(self) -> None:
        for task in self.tasks:
            if task not in TASKS:
                raise unknown("task", task, TASKS)
        if not 0 <= self.test_fraction <= 1:
            raise UserError(f"test fraction: expected a number from 0 to 1, found {self.test_fraction}")


Progress = Callable[[str, int, int], None]
"""Told what is being read, and how many of how many recordings are done."""


def choose_recordings(
    source: ArcticSource, objects: Iterable[str] = (), subjects: Iterable[str] = (), *, reconstructed: bool = False
) -> dict[str, list[Recording]]:
    """The recordings of imported objects, by object.

    Args:
        source: A user's copy of ARCTIC.
        objects: Only these; all that were imported by default.
        subjects: Only these; all by default.
        reconstructed: Choose the reconstructions from images instead.

    Raises:
        UserError: an object was not imported, or there is no such recording.
    """
    imported = list_assets("objects")
    for name in objects:
        if name not in imported:
            raise unknown("object", name, imported)
    found = {
        name: find_recordings(source, name, reconstructed=reconstructed) for name in dict.fromkeys(objects) or imported
    }
    known = {each.subject for recordings in found.values() for each in recordings}
    for subject in subjects:
        if subject not in known:
            raise unknown("subject", subject, known)
    wanted = set(subjects) or known
    chosen = {name: [each for each in recordings if each.subject in wanted] for name, recordings in found.items()}
    for name in objects:
        if not chosen[name]:
            raise UserError(f"{source.path}: expected recordings of {name!r}, found none")
    if not any(chosen.values()):
        what = "reconstructions" if reconstructed else "recordings"
        raise UserError(f"{source.path}: expected {what} of any object of `artigrasp list objects`, found none")
    return {name: recordings for name, recordings in chosen.items() if recordings}


def extract_references(
    extractor: Extractor,
    recordings: dict[str, list[Recording]],
    selection: Selection,
    out: Path,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> dict[Path, ReferenceSet]:
    """Write ``OUT/references/OBJECT.npz`` for every object in whose recordings something was found.

    Args:
        extractor: Applies the rules.
        recordings: Of each object.
        selection: Which interactions become references, and of which split.
        out: Folder to write to.
        overwrite: Whether to replace files.
        progress: Called before the first recording and after each.

    Returns:
        What was written, by file.

    Raises:
        UserError: a file exists already, or a recording is missing or malformed. Objects that were finished by then
            stay.
    """
    files = {name: out / "references" / f"{name}.npz" for name in recordings}
    for file in files.values():
        check_target(file)
        if file.exists() and not overwrite:
            raise UserError(f"{file}: exists already: choose another folder with --out, or say --overwrite")
    written = {}
    for name, extractions in extract_all(extractor, recordings, progress):
        references = make_extracted_references(extractor, load_object(name), extractions, selection)
        if references is not None:
            save_references(files[name], references)
            written[files[name]] = references
    return written


def extract_all(
    extractor: Extractor, recordings: dict[str, list[Recording]], progress: Progress | None = None
) -> Iterator[tuple[str, list[Extraction]]]:
    """What is found in the recordings of each object, object by object."""
    total, done = sum(map(len, recordings.values())), 0
    for name, of_object in recordings.items():
        model, found = load_object(name), []
        for each in of_object:
            if progress is not None:
                progress(f"{each.subject} {each.sequence}", done, total)
            found.append(extractor.extract(model, each))
            done += 1
        yield name, found
    if progress is not None:
        progress("", done, total)


def make_extracted_references(
    extractor: Extractor, model: ObjectModel, extractions: Iterable[Extraction], selection: Selection
) -> ReferenceSet | None:
    """The references of an object that were found in recordings of it, or None if none were.

    Those from reconstructions are all of one split, as the authors' are; the others are parted by lot.
    """
    kept = [(each, found) for each in extractions for found in each.interactions if found.task in selection.tasks]
    if not kept:
        return None
    splits = draw_splits(len(kept), selection, model.name)
    frames = [
        _labelled_frame(each, found, IMAGES if each.recording.reconstructed else split)
        for (each, found), split in zip(kept, splits, strict=True)
    ]
    provenance = describe_provenance(
        "extract-references",
        measured_contacts=extractor.measure,
        selection=asdict(selection),
        settings=asdict(extractor.config),
    )
    return replace(make_references(model, frames, extractor.mean_pose), provenance=provenance)


def draw_splits(count: int, selection: Selection, name: str) -> list[str]:
    """The split of each of an object's references, which depends on no other object."""
    draw = np.random.default_rng([selection.seed, *name.encode()])
    for_test = draw.permutation(count) < round(selection.test_fraction * count)
    train, test = PARTED
    return [test if each else train for each in for_test]


def _labelled_frame(extraction: Extraction, found: Interaction, split: str) -> LabelledFrame:
    shown, frame = extraction.shown, found.frame
    return LabelledFrame(
        label=Label(split, extraction.recording, found.task, found.initial_frame, frame),
        initial_state=extraction.states[found.initial_frame],
        state=shown.object_state[frame],
        rotation=shown.rotation[frame],
        pose=shown.pose[frame],
        translation=shown.translation[frame],
        contacts=extraction.contacts[frame],
    )
