"""Extraction from recordings in files: both layouts, reconstructions, what becomes references, what is refused."""

import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.arctic import find_source
from artigrasp.assets.object import load_object
from artigrasp.config import ExtractionConfig
from artigrasp.errors import UserError
from artigrasp.kernels.layout import ARTICULATED, BASE, LINKS
from artigrasp.references.arctic_references import TASKS
from artigrasp.references.extracted_references import Selection, choose_recordings, draw_splits, extract_references
from artigrasp.references.extraction import Extraction, Extractor
from artigrasp.references.interactions import FRAME_RATE, Interaction
from artigrasp.references.reference import ReferenceSet, read_references
from tests.references import recording_example as example
from tests.references.arctic_example import save

CONFIG = ExtractionConfig()
DELAY = round(CONFIG.delay * FRAME_RATE)


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The assets that the recording is of."""
    folder = tmp_path_factory.mktemp("assets")
    example.write_assets(folder)
    return folder


@pytest.fixture(autouse=True)
def surroundings(assets: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Assets are found by name."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(assets))


def extractor(root: Path, *, measure: bool = False) -> Extractor:
    """The rules on a copy of the data."""
    return Extractor(find_source(root), CONFIG, measure=measure)


def extract(root: Path, *, reconstructed: bool = False, measure: bool = False) -> Extraction:
    """What is found in the made-up recording."""
    recording = example.RECORDING._replace(reconstructed=reconstructed)
    return extractor(root, measure=measure).extract(load_object("box"), recording)


def write(root: Path, out: Path, selection: Selection | None = None, **options: bool) -> ReferenceSet:
    """Extract everything, and read what was written."""
    recordings = choose_recordings(find_source(root))
    written = extract_references(extractor(root), recordings, selection or Selection(), out, **options)
    assert list(written) == [out / "references" / "box.npz"]
    return read_references(out / "references" / "box.npz")


def assert_known(interactions: tuple[Interaction, ...]) -> None:
    """They are those of the made-up recording, to a frame, which smoothing may cost."""
    carried, opened = interactions
    assert (carried.task, opened.task) == ("two_grasp", "right_arti")
    for found, frames in ((carried, example.CARRIED), (opened, example.OPENED)):
        np.testing.assert_allclose((found.first, found.last), frames, atol=1)
        assert found.frame == found.first + DELAY
        assert found.initial_frame <= found.first


@pytest.mark.parametrize(
    ("layout", "contacts", "measure"),
    [("release", True, False), ("release", True, True), ("release", False, False), ("download", False, False)],
)
def test_known_interactions_are_found(layout: str, contacts: bool, measure: bool, tmp_path: Path) -> None:
    """In either layout, with contacts given or measured."""
    root = example.write_recording(tmp_path, layout, contacts=contacts)
    assert_known(extract(root, measure=measure).interactions)


def test_contacts_are_measured_only_without_given_ones(tmp_path: Path) -> None:
    """Given ones are taken as they are, unless measured ones are asked for."""
    root = example.write_recording(tmp_path, "release")
    np.testing.assert_array_equal(extract(root).contacts, example.given_contacts())
    measured = extract(root, measure=True).contacts
    links = measured.sum(axis=-1)
    held, on_lid = slice(*example.HELD), slice(*example.ON_LID)
    thumb = LINKS.index("thumb1")
    assert (links[held, :, 1] >= 10).all() and not measured[held, :, 0, :thumb].any()
    assert (links[on_lid, 1, 0] >= 3).all() and not links[on_lid, 0].any() and not links[on_lid, 1, 1].any()
    untouched = np.ones(len(links), bool)
    untouched[held] = untouched[on_lid] = False
    assert not links[untouched].any()


@pytest.mark.parametrize("contacts", [True, False])
def test_reconstructions_touch_what_the_recording_moves(contacts: bool, tmp_path: Path) -> None:
    """A reconstruction has hands relative to the object in the frame of a camera; the recording says what moves."""
    root = example.write_recording(tmp_path, "release")
    example.write_recording(tmp_path, "release", contacts=contacts, reconstructed=True)
    shown, recorded = extract(root, reconstructed=True), extract(root)
    assert_known(shown.interactions)
    np.testing.assert_array_equal(shown.states, recorded.states)
    recordings = choose_recordings(find_source(root), reconstructed=True)
    extract_references(extractor(root), recordings, Selection(), tmp_path / "images")
    images = read_references(tmp_path / "images" / "references" / "box.npz")
    mocap = write(root, tmp_path / "mocap")
    assert set(images.split.tolist()) == {"recon"}
    np.testing.assert_allclose(images.wrist_pose_in_part, mocap.wrist_pose_in_part, atol=1e-4)
    np.testing.assert_allclose(images.object_pose, mocap.object_pose, atol=1e-5)


def test_references_hold_what_their_frame_shows(tmp_path: Path) -> None:
    """Poses relative to the part, contacts with it, the resting object, and where all this comes from."""
    references = write(example.write_recording(tmp_path, "release"), tmp_path / "out")
    assert references.kind.tolist() == ["grasp", "articulate"]
    assert references.active.tolist() == [[True, True], [False, True]]
    assert references.part.tolist() == [[BASE, BASE], [BASE, ARTICULATED]]
    for hand, side in enumerate(("left", "right")):
        np.testing.assert_allclose(references.wrist_pose_in_part[0, hand, :3], example.HOLDING[side], atol=1e-5)
    np.testing.assert_allclose(references.wrist_pose_in_part[1, 1, :3], example.LYING, atol=1e-5)
    np.testing.assert_allclose(references.finger_angles, 0, atol=1e-6)
    assert references.contacts.sum(axis=-1).tolist() == [[12, 12], [0, 4]]
    np.testing.assert_allclose(references.object_pose[:, 2], 0, atol=1e-6)
    subject, sequence, _ = example.RECORDING
    assert set(references.subject) == {subject} and set(references.sequence) == {sequence}
    np.testing.assert_allclose(references.frame, [40 + DELAY, 130 + DELAY], atol=1)
    assert "box_use_01 s1 init" in references.source[0]
    provenance = json.loads(references.provenance)
    assert provenance["made_by"] == "extract-references" and provenance["settings"] == asdict(CONFIG)
    assert provenance["selection"] == asdict(Selection()) | {"tasks": list(Selection().tasks)}


def test_only_wanted_tasks_become_references(tmp_path: Path) -> None:
    """An object of which nothing is wanted gets no file."""
    root = example.write_recording(tmp_path, "release")
    assert write(root, tmp_path / "out", Selection(tasks=("right_arti",))).kind.tolist() == ["articulate"]
    recordings = choose_recordings(find_source(root))
    assert extract_references(extractor(root), recordings, Selection(tasks=("left_arti",)), tmp_path / "none") == {}
    assert not (tmp_path / "none").exists()
    with pytest.raises(UserError, match=r"unknown task 'right_art': did you mean 'right_arti'\?"):
        Selection(tasks=("right_art",))
    assert set(Selection().tasks) < set(TASKS)


def test_splits_are_drawn_with_the_seed() -> None:
    """The share is exact, the same seed draws the same, and objects are drawn independently."""
    selection = Selection()
    first = draw_splits(40, selection, "box")
    assert first.count("test") == 14 and first.count("train") == 26
    assert draw_splits(40, selection, "box") == first
    assert draw_splits(40, replace(selection, seed=1), "box") != first != draw_splits(40, selection, "laptop")
    with pytest.raises(UserError, match=r"test fraction: expected a number from 0 to 1, found 1\.5"):
        Selection(test_fraction=1.5)


def test_files_are_replaced_only_when_asked(tmp_path: Path) -> None:
    """What is there stays, whatever it is."""
    root = example.write_recording(tmp_path, "release")
    file = tmp_path / "out" / "references" / "box.npz"
    file.parent.mkdir(parents=True)
    file.write_text("mine")
    with pytest.raises(UserError, match=r"box.npz: exists already: choose another folder with --out, or say --overwri"):
        write(root, tmp_path / "out")
    assert file.read_text() == "mine"
    assert len(write(root, tmp_path / "out", overwrite=True)) == 2


def test_progress_counts_recordings(tmp_path: Path) -> None:
    """It tells what is being read, and ends with all of them."""
    root = example.write_recording(tmp_path, "release")
    told: list[tuple[str, int, int]] = []
    recordings = choose_recordings(find_source(root))
    extract_references(
        extractor(root), recordings, Selection(), tmp_path / "out", progress=lambda *each: told.append(each)
    )
    assert told == [("s1 box_use_01", 0, 1), ("", 1, 1)]


def test_recordings_are_chosen_by_name(tmp_path: Path) -> None:
    """Unknown names are refused with the nearest known one; other files in the folders are not recordings."""
    root = example.write_recording(tmp_path, "release")
    hands = root / "rsc" / "mano_double" / "s1"
    for name in ("box_use_02", "box_", "box_use_03;rm"):
        shutil.copy(hands / "box_use_01.mano.npy", hands / f"{name}.mano.npy")
    source = find_source(root)
    # The second has no object, the others no name.
    assert choose_recordings(source) == {"box": [example.RECORDING]}
    for options, message in (
        ({"objects": ["bix"]}, r"unknown object 'bix': did you mean 'box'\?"),
        ({"objects": ["lidded-box"]}, "expected recordings of 'lidded-box', found none"),
        ({"subjects": ["s2"]}, r"unknown subject 's2': did you mean 's1'\?"),
        ({"reconstructed": True}, "expected reconstructions of any object of `artigrasp list objects`, found none"),
    ):
        with pytest.raises(UserError, match=message):
            choose_recordings(source, **options)  # type: ignore[arg-type]


def test_bad_recordings_are_refused(tmp_path: Path) -> None:
    """The message names the file; nothing is written."""
    root = example.write_recording(tmp_path, "release")
    states = root / "rsc" / "arctic" / "box" / "s1" / "box_use_01.object.npy"
    good = np.load(states)
    for value, message in (
        (
            good[:100],
            r"box_use_01.object.npy: states: expected shape \(T=220, 7\), found \(100, 7\)",
        ),
        (good / 1000, r"box_use_01.object.npy: states\[0\]: expected 100 to 10000 mm"),
        (np.array("nonsense"), r"box_use_01.object.npy: states: expected numbers"),
    ):
        save(states, value)
        with pytest.raises(UserError, match=message):
            write(root, tmp_path / "out")
        assert not (tmp_path / "out").exists()
    states.write_bytes(b"\x93NUMPY half")
    with pytest.raises(UserError, match=r"box_use_01.object.npy: "):
        write(root, tmp_path / "out")


def test_a_single_frame_is_no_recording(tmp_path: Path) -> None:
    """Nothing moves in it."""
    root = example.write_recording(tmp_path, "download")
    for path in root.glob("raw_seqs/s01/*"):
        value = np.load(path, allow_pickle=True)
        mano = value.dtype.hasobject
        first = (
            {side: {name: rows[:1] for name, rows in of.items()} for side, of in value.item().items()} if mano else None
        )
        save(path, first if mano else value[:1])
    with pytest.raises(UserError, match=r"box_use_01\.object\.npy: states: expected at least 2 frames, found 1"):
        extract(root)


def test_reconstructions_need_their_recording(tmp_path: Path) -> None:
    """Without it nobody knows what moves; with another one, what is what."""
    root = example.write_recording(tmp_path, "release", reconstructed=True)
    with pytest.raises(UserError, match="expected the recording box_use_01 of s1, found none"):
        extract(root, reconstructed=True)
    example.write_recording(tmp_path, "release", contacts=False)
    for path in root.glob("rsc/**/s1/box_use_01.object.npy"):
        save(path, np.load(path)[:-1])
    for path in root.glob("rsc/**/s1/box_use_01.mano.npy"):
        hands = np.load(path, allow_pickle=True).item()
        save(path, {side: {name: rows[:-1] for name, rows in hand.items()} for side, hand in hands.items()})
    with pytest.raises(UserError, match="states: expected 219 frames, as recorded, found 220"):
        extract(root, reconstructed=True)


def test_hands_must_have_been_imported(tmp_path: Path, assets: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to get them."""
    shutil.copytree(assets / "objects", tmp_path / "bare" / "objects")
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "bare"))
    root = example.write_recording(tmp_path, "release")
    with pytest.raises(UserError, match="no such file: extraction needs MANO's hands, which import-arctic makes"):
        write(root, tmp_path / "out")
