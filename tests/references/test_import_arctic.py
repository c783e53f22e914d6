"""The import on made-up copies of ARCTIC: every layout, what is kept, what is refused."""

import json
import os
import shutil
from collections import Counter
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from artigrasp.assets.fidelity import Fidelity
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS
from artigrasp.references import arctic
from artigrasp.references.arctic import import_arctic
from artigrasp.references.reference import ReferenceSet, load_references
from tests.references import arctic_example as example

PERFECT = Fidelity(1, 0, 1.0, 0.0, 0.0, 0.0, 0.0)
ALL_FILES = {
    *(f"hands/mano_{name}" for name in ("left.usda", "right.usda", "mean_pose.npz")),
    "objects/box.usda",
    "references/box.npz",
}


pytestmark = pytest.mark.usefixtures("quick_skins")


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the pieces of the made-up object are kept for all tests."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def surroundings(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Imports land in a folder of the test; only tests that look at the figures wait for them."""
    if "measured" not in request.fixturenames:
        monkeypatch.setattr(arctic, "measure_fidelity", lambda mesh, pieces: PERFECT)
    monkeypatch.setenv("ARTIGRASP_CACHE", str(cache))
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "assets"))


@pytest.fixture
def measured() -> None:
    """Has the pieces compared with their mesh in earnest."""


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """A made-up release without the compact file, whose meshes were cut once."""
    root = example.write_release(tmp_path_factory.mktemp("release"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARTIGRASP_CACHE", str(cache))
        import_arctic(root, destination=tmp_path_factory.mktemp("first"))
    return root


def files_in(folder: Path) -> set[str]:
    """Every file below a folder, without the manifest."""
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return found - {"manifest.json"}


def assert_same_references(found: ReferenceSet, expected: ReferenceSet) -> None:
    """Two sets agree in everything."""
    for field in fields(ReferenceSet):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)


def test_release_with_pickled_labels(release: Path, tmp_path: Path) -> None:
    """Hands, object and all references come out of the release alone, image references with their counterparts."""
    report = import_arctic(release)
    assert set(report.written) == ALL_FILES == files_in(tmp_path / "assets")
    assert report.skipped == [] and report.unchanged == []
    references = load_references("box")
    counts = Counter(zip(references.split.tolist(), references.kind.tolist(), strict=True))
    assert counts == {
        ("train", "articulate"): 1,
        ("train", "grasp"): 2,
        ("test", "articulate"): 1,
        ("test", "grasp"): 1,
        **{(split, kind): 1 for split in ("recon", "recon-mocap") for kind in ("articulate", "grasp")},
    }
    assert references.subject.tolist() == ["s1", "s1", "s2", "s1", *["s5"] * 5]
    assert references.frame.tolist() == [3, 2, 5, 6, 4, 4, 7, 4, 7]
    assert references.source[0] == "box_use_02 s1 init 1 grasp 3" and references.sequence[0] == "box_use_02"
    model = load_object("box")
    assert [part.mass for part in model.parts] == pytest.approx([0.9, 0.1])
    assert (model.hinge_upper, model.hinge_damping) == (pytest.approx(2.5), pytest.approx(0.05))


def test_hands_are_the_urdfs(release: Path) -> None:
    """What the URDF says comes through: bones, limits, masses and shapes."""
    import_arctic(release)
    for side in HANDS:
        hand, expected = load_hand("mano", side), load_hand("open", side)
        for name in ("link_offset", "tip_offset", "lower", "upper", "damping", "link_mass", "link_inertia"):
            np.testing.assert_allclose(getattr(hand, name), getattr(expected, name), atol=1e-6, err_msg=name)
        assert [len(link) for link in hand.colliders] == [len(link) for link in expected.colliders]


def test_compact_file_gives_the_same(release: Path, tmp_path: Path) -> None:
    """The compact file and the release's own labels make the same references, one after the other and apart."""
    import_arctic(release)
    expected = load_references("box")
    labels = example.write_labelled_frames(tmp_path / "labelled_frames.npz")
    report = import_arctic(labels)
    assert report.written == ["references/box.npz"]
    assert any("4 " in line or "2 recon labels of s5: their sequences are not here" in line for line in report.skipped)
    mocap = np.isin(expected.split, ("train", "test"))
    found = load_references("box")
    assert set(found.split.tolist()) == {"train", "test"}
    np.testing.assert_array_equal(found.source, expected.source[mocap])
    np.testing.assert_array_equal(found.wrist_pose_in_part, expected.wrist_pose_in_part[mocap])

    both = shutil.copytree(release, tmp_path / "both")
    example.write_labelled_frames(both / "labelled_frames.npz")
    import_arctic(both)
    assert_same_references(load_references("box"), expected)


def test_compact_file_needs_objects(tmp_path: Path) -> None:
    """References are not made of objects that are not there; nothing is written, and the message says what to do."""
    labels = example.write_labelled_frames(tmp_path / "labelled_frames.npz")
    for path in (labels, tmp_path):
        with pytest.raises(UserError, match="no references without object and hands"):
            import_arctic(path)
    assert not (tmp_path / "assets").exists()


def test_official_download(tmp_path: Path, release: Path) -> None:
    """Objects come in metres, with a mass by density, all objects there are; labels make references of them too."""
    root = example.write_download(tmp_path / "download")
    report = import_arctic(root, mano=example.write_mano(tmp_path / "MANO_RIGHT.pkl", example.mano_model()))
    assert {"objects/box.usda", "objects/scissors.usda"} < set(report.written)
    assert sorted(report.skipped) == [f"{name}: no references without labelled frames" for name in ("box", "scissors")]
    box, scissors = load_object("box"), load_object("scissors")
    assert [part.mass for part in scissors.parts] == pytest.approx([1.2, 0.24], rel=1e-4)
    assert [part.mass for part in box.parts] == pytest.approx([1.2, 0.06], rel=1e-4)
    base, _ = example.boxes()
    np.testing.assert_allclose(box.parts[0].com, base.center_mass, atol=1e-6)
    np.testing.assert_allclose(box.parts[0].inertia, base.moment_inertia * 1000, atol=1e-7)
    np.testing.assert_allclose(np.ptp(box.vertices_in_base(0.0), axis=0), (0.12, 0.12, 0.10), atol=1e-6)
    assert (box.hinge_lower, box.hinge_upper) == (0.0, pytest.approx(np.pi))

    example.write_labelled_frames(root / "labelled_frames.npz")
    again = import_arctic(root, objects=["box"])
    assert again.written == ["references/box.npz"]
    found = load_references("box")
    assert Counter(found.split.tolist()) == {"train": 3, "test": 2, "recon": 2}
    assert any("2 recon-mocap labels of s5" in line for line in again.skipped)
    import_arctic(release)
    expected = load_references("box").select(split="recon")
    np.testing.assert_allclose(found.select(split="recon").object_pose[:, 3:], expected.object_pose[:, 3:], atol=1e-6)


@pytest.mark.parametrize("where", ["", "arctic_data", "arctic_data/data"])
def test_download_is_found_from_any_of_its_folders(where: str, tmp_path: Path) -> None:
    """The folder above, the download's own and its data folder are all recognised."""
    root = example.write_download(tmp_path / "download", objects=("box",))
    assert "objects/box.usda" in import_arctic(root / where).written


@pytest.mark.parametrize("top_number", [0, 1])
@pytest.mark.parametrize("keypoints", [True, False])
def test_one_mesh_with_parts(top_number: int, keypoints: bool, tmp_path: Path) -> None:
    """Without meshes of the parts, the one of both is parted; the keypoints tell the lid, whichever number it has."""
    root = example.write_download(tmp_path / "download", objects=("box",), parted=False)
    folder = root / "arctic_data/data/meta/object_vtemplates/box"
    lid = example.boxes()[1]
    if keypoints:
        points = (1000 * lid.sample(30, seed=0)).tolist()
        (folder / "top_keypoints_300.json").write_text(json.dumps({"keypoints": points}))
    if top_number == 0:
        numbers = json.loads((folder / "parts.json").read_text())
        (folder / "parts.json").write_text("\n".join(str(1 - number) for number in numbers))
    import_arctic(root)
    if top_number == 0 and not keypoints:
        assert np.ptp(load_object("box").parts[0].vertices[:, 1]) == pytest.approx(0.02)
        return
    for part, mesh in zip(load_object("box").parts, example.boxes(), strict=True):
        assert part.vertices.shape == mesh.vertices.shape and part.faces.shape == mesh.faces.shape
        assert sorted(np.round(part.vertices, 6).tolist()) == sorted(np.round(mesh.vertices, 6).tolist())


def test_mano_model(tmp_path: Path, release: Path) -> None:
    """The hands of MANO's file have its joints and mean pose; the left is the right's mirror image."""
    path = example.write_mano(tmp_path / "mano" / "models" / "MANO_RIGHT.pkl", example.mano_model())
    report = import_arctic(release, mano=tmp_path / "mano")
    assert "hands/mano_right.usda" in report.written
    right, left, expected = load_hand("mano", "right"), load_hand("mano", "left"), load_hand("open", "right")
    np.testing.assert_allclose(right.link_offset, expected.link_offset, atol=1e-6)
    np.testing.assert_allclose(right.tip_offset, expected.tip_offset, atol=1e-6)
    np.testing.assert_allclose(left.link_offset, right.link_offset * [-1, 1, 1], atol=1e-6)
    assert (right.link_mass > 0).all() and all(right.colliders)
    with np.load(tmp_path / "assets" / "hands" / "mano_mean_pose.npz") as archive:
        np.testing.assert_allclose(archive["right"], 0.01 * np.arange(45.0))
        np.testing.assert_allclose(archive["left"], archive["right"] * np.tile([1, -1, -1], 15))
    assert import_arctic(release, mano=path).written == []
    assert "hands/mano_right.usda" in import_arctic(release).written


@pytest.mark.parametrize("protocol", [0, 1, 2, 3])
def test_mano_in_every_protocol(protocol: int, tmp_path: Path, release: Path) -> None:
    """MANO's own files are of Python 2: every old protocol is read."""
    path = example.write_mano(tmp_path / "MANO_RIGHT.pkl", example.mano_model(), protocol)
    assert "hands/mano_right.usda" in import_arctic(release, mano=path).written


SPARSE = {"data": np.ones(1), "indices": np.zeros(1, int), "indptr": np.array([0, 1, 1, 1]), "shape": (16, 3)}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("v_template", None, "v_template: expected an array, found none"),
        ("weights", np.ones((144, 16)), "weights: expected at least 4 vertices that index1 moves most"),
        ("weights", np.ones((144, 15)), "weights: expected shape (V=144, 16), found (144, 15)"),
        ("hands_mean", np.full(45, np.nan), "hands_mean[0]: expected a finite number"),
        ("J_regressor", example.Ch(np.zeros((16, 3))), "J_regressor: expected shape"),
        ("J_regressor", SPARSE | {"shape": (2**20, 2**20)}, "J_regressor: expected the shape of a sparse matrix"),
        ("J_regressor", SPARSE | {"shape": ("16", None)}, "J_regressor: expected the shape of a sparse matrix"),
        ("J_regressor", SPARSE | {"indices": {}}, "J_regressor.indices: expected"),
        ("kintree_table", np.zeros((2, 16), np.int64), "kintree_table: expected the links wrist"),
    ],
)
def test_bad_mano_model_is_named(name: str, value: Any, message: str, tmp_path: Path, release: Path) -> None:
    """A model with a missing or wrong entry is refused by name before anything is written."""
    path = example.write_mano(tmp_path / "MANO_RIGHT.pkl", example.mano_model() | {name: value})
    with pytest.raises(UserError) as caught:
        import_arctic(release, mano=path)
    assert message in str(caught.value) and str(path) in str(caught.value)
    assert not (tmp_path / "assets").exists()


def test_mano_in_millimetres_is_refused(tmp_path: Path, release: Path) -> None:
    """A hand of two hundred metres is in another unit."""
    model = example.mano_model()
    model["v_template"] = model["v_template"].x * 1000
    with pytest.raises(UserError, match=r"expected a hand of 0.1 to 0.3 m"):
        import_arctic(release, mano=example.write_mano(tmp_path / "MANO_RIGHT.pkl", model))
    with pytest.raises(UserError, match=r"expected MANO_RIGHT.pkl or MANO_LEFT.pkl, found none"):
        import_arctic(release, mano=tmp_path / "nowhere")


def test_importing_again_changes_nothing(release: Path, tmp_path: Path, measured: None) -> None:
    """A second import writes nothing and tells the same figures; a changed or damaged product is made anew."""
    first = import_arctic(release)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "assets").rglob("*")}
    again = import_arctic(release)
    assert again.written == [] and set(again.unchanged) == ALL_FILES
    assert again.parts == first.parts and set(first.parts["box"]) == {"base", "articulated"}
    assert first.parts["box"]["base"]["volume_ratio"] == pytest.approx(1.0, abs=0.02)
    assert first.parts["box"]["base"]["outward_p95_mm"] < 0.01 and first.parts["box"]["base"]["open_edges"] == 0
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "assets").rglob("*")} == before
    (tmp_path / "assets" / "objects" / "box.usda").write_text("damaged")
    assert import_arctic(release).written == ["objects/box.usda"]
    manifest = tmp_path / "assets" / "manifest.json"
    document = json.loads(manifest.read_text())
    document["files"]["objects/box.usda"]["parts"]["base"]["volume_ratio"] = 7.0
    for text in ("", "[]", '{"format": "artigrasp.manifest", "version": 3}', "[" * 100_000, json.dumps(document)):
        manifest.write_text(text)
        assert set(import_arctic(release).written) == ALL_FILES
    entry = json.loads(manifest.read_text())["files"]["objects/box.usda"]
    assert set(entry) == {"sources", "content", "parts"}


def test_changed_source_is_noticed(release: Path, tmp_path: Path) -> None:
    """New labels make new references, and nothing else anew."""
    root = shutil.copytree(release, tmp_path / "copy")
    import_arctic(root)
    labels = root / "rsc/mano_double/grasp_label/final_labels/train_set/box.npy"
    listed = np.load(labels, allow_pickle=True)
    example.save(labels, listed[:1])
    assert import_arctic(root).written == ["references/box.npz"]
    assert len(load_references("box").select(split="train")) == 1


@pytest.mark.parametrize("value", [np.inf, np.nan, None, "x", [1], 10**30])
@pytest.mark.parametrize("field", ["seq_num", "grasp_frame"])
def test_a_label_that_is_no_number_is_refused(field: str, value: Any, release: Path, tmp_path: Path) -> None:
    """Whatever was pickled in its place."""
    root = shutil.copytree(release, tmp_path / "copy")
    labels = root / "rsc/mano_double/grasp_label/final_labels/train_set/box.npy"
    listed = np.load(labels, allow_pickle=True)
    listed[0][field] = value
    example.save(labels, listed)
    with pytest.raises(UserError, match=r"box.npy: "):
        import_arctic(root)


def test_progress_counts_every_step(release: Path) -> None:
    """The bar starts at nothing, never goes back and ends full, for a first and for a second import."""
    for _ in range(2):
        done: list[int] = []
        totals: set[int] = set()

        def note(_: str, step: int, total: int, done: list[int] = done, totals: set[int] = totals) -> None:
            done.append(step)
            totals.add(total)

        import_arctic(release, progress=note)
        assert done[0] == 0 and done == sorted(done) and {done[-1]} == totals == {7}


def test_labels_of_other_subjects_are_counted(release: Path, tmp_path: Path) -> None:
    """Labels whose recording the user does not have are told by split and subject; all others come through."""
    root = shutil.copytree(release, tmp_path / "copy")
    shutil.rmtree(root / "rsc" / "mano_double" / "s2")
    report = import_arctic(root)
    assert report.skipped == ["box: 1 train labels of s2: their sequences are not here"]
    assert Counter(load_references("box").split.tolist())["train"] == 2


def test_wrong_folders_are_named(tmp_path: Path, release: Path) -> None:
    """Nothing known, a file of something else, an object and a number of processes that cannot be."""
    with pytest.raises(UserError, match=r"expected ARCTIC as rsc/arctic/<object>/.*found none of them"):
        import_arctic(tmp_path)
    with pytest.raises(UserError, match="found nothing"):
        import_arctic(tmp_path / "nowhere")
    (tmp_path / "note.txt").write_text("nothing")
    with pytest.raises(UserError, match=r"note.txt: expected an .npz archive of plain arrays"):
        import_arctic(tmp_path / "note.txt")
    with pytest.raises(UserError, match="unknown object 'bax': did you mean 'box'"):
        import_arctic(release, objects=["bax"])
    with pytest.raises(UserError, match="expected at least 1 process"):
        import_arctic(release, processes=0)
    assert not (tmp_path / "assets").exists()


class MakesFolder:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, (str(self.path),)


PICKLED = (
    "rsc/mano_double/s1/box_use_02.mano.npy",
    "rsc/arctic/box/s1/box_use_02.object.npy",
    "rsc/mano_double/s5_recon/box_use_02.mano.npy",
    "rsc/mano_double/contact/s1/box_use_02_a_r.npy",
    "rsc/mano_double/grasp_label/final_labels/train_set/box.npy",
)


@pytest.mark.parametrize("name", PICKLED)
def test_malicious_pickle_does_not_run(name: str, release: Path, tmp_path: Path) -> None:
    """A program in any file of the folder is refused by the file's name, and never runs."""
    root = shutil.copytree(release, tmp_path / "copy")
    trace = tmp_path / "trace"
    example.save(root / name, np.array({"left": MakesFolder(trace)}, object))
    with pytest.raises(UserError, match="expected arrays, dictionaries, lists, text and numbers") as caught:
        import_arctic(root)
    assert name in str(caught.value) and not trace.exists()
    assert files_in(tmp_path / "assets") == ALL_FILES - {"references/box.npz"}


def test_malicious_compact_file_and_model_do_not_run(release: Path, tmp_path: Path) -> None:
    """Neither the compact file nor MANO's is a place for programs."""
    trace = tmp_path / "trace"
    labels = example.write_labelled_frames(tmp_path / "labels" / "labelled_frames.npz")
    with np.load(labels) as archive:
        arrays = dict(archive)
    np.savez(labels, **(arrays | {"split": np.array([MakesFolder(trace)], object)}))
    with pytest.raises(UserError, match="archive of plain arrays"):
        import_arctic(labels)
    mano = example.write_mano(tmp_path / "MANO_RIGHT.pkl", example.mano_model() | {"bs_style": MakesFolder(trace)})
    with pytest.raises(UserError, match=r"found '(posix|nt)\.mkdir'"):
        import_arctic(release, mano=mano)
    assert not trace.exists()


@pytest.mark.parametrize("sequence", ["../../../secret", "box_use_02/..", "laptop_use_01", "box", ""])
def test_labels_cannot_lead_elsewhere(sequence: str, release: Path, tmp_path: Path) -> None:
    """A label that names no recording of its object is refused, above all one that leads out of the folder."""
    root = shutil.copytree(release, tmp_path / "copy")
    row = {"seq_num": 1, "seq_name": sequence, "init_frame": 1, "grasp_frame": 2, "kind": "right_arti"}
    example.save(root / "rsc/mano_double/grasp_label/final_labels/test_set/box.npy", np.array([row], object))
    with pytest.raises(UserError, match="label 0: expected a sequence of the object 'box'"):
        import_arctic(root)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("rsc/arctic/box/s1/box_use_02.object.npy", lambda x: x / 1000, r"states\[0\]: expected 100 to 10000 mm"),
        ("rsc/arctic/box/s1/box_use_02.object.npy", lambda x: np.degrees(x), r"states\[.\]: expected .* rad"),
        ("rsc/arctic/box/s1/box_use_02.object.npy", lambda x: x[:, :6], r"states: expected shape \(T=8, 7\)"),
        ("rsc/arctic/box/s1/box_use_02.object.npy", lambda x: x[:5], r"states: expected shape \(T=8, 7\)"),
        ("rsc/arctic/box/s1/box_use_02.object.npy", lambda x: x * np.nan, "expected a finite number"),
        ("rsc/mano_double/contact/s1/box_use_02_a_l.npy", lambda x: 7 * x, "contacts.*expected 0 to 1"),
        ("rsc/mano_double/contact/s1/box_use_02_a_l.npy", lambda x: x[..., :15], "contacts: expected shape"),
    ],
)
def test_wrong_units_and_shapes_are_named(name: str, change: Any, message: str, release: Path, tmp_path: Path) -> None:
    """Metres for millimetres, degrees for radians, lengths that do not fit: the file, the field and the place."""
    root = shutil.copytree(release, tmp_path / "copy")
    example.save(root / name, change(np.load(root / name)))
    with pytest.raises(UserError, match=message) as caught:
        import_arctic(root)
    assert name in str(caught.value)


def test_hands_in_millimetres_are_refused(release: Path, tmp_path: Path) -> None:
    """MANO's translations are in metres."""
    root = shutil.copytree(release, tmp_path / "copy")
    wrong = example.hands(1)
    wrong["right"]["trans"] = wrong["right"]["trans"] * 1000
    example.save(root / "rsc/mano_double/s1/box_use_02.mano.npy", wrong)
    with pytest.raises(UserError, match=r"right\.trans\[0\]: expected 0 to 10 m, found"):
        import_arctic(root)


@pytest.mark.parametrize("factor", [1000.0, 1e-3])
def test_objects_in_other_units_are_refused(factor: float, release: Path, tmp_path: Path) -> None:
    """An object of a hundred metres, or of a tenth of a millimetre, is named before it is cut."""
    root = shutil.copytree(release, tmp_path / "copy")
    for name, mesh in zip(("bottom", "top"), example.boxes(), strict=True):
        mesh.apply_scale(factor)
        mesh.export(root / f"rsc/arctic/box/{name}_watertight_tiny.obj")
    with pytest.raises(UserError, match=r"expected an object of 0.02 to 2.0 m, in metres, found"):
        import_arctic(root)


def test_a_flat_mesh_is_named(release: Path, tmp_path: Path) -> None:
    """One whose vertices have two coordinates, the third column being lost; such a plane has a hull, too."""
    root = shutil.copytree(release, tmp_path / "copy")
    path = root / "rsc/arctic/box/bottom_watertight_tiny.obj"
    words = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    lines = [" ".join(each[:3] if each and each[0] == "v" else each) for each in words]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"bottom_watertight_tiny\.obj: .* expected three coordinates of every vertex"):
        import_arctic(root, destination=tmp_path / "assets")


def test_open_mesh_gets_pieces_and_a_mass(tmp_path: Path, measured: None) -> None:
    """A mesh with a hole is cut all the same; its mass is that of its pieces, and its open edges are told."""
    root = example.write_download(tmp_path / "download", objects=("box",))
    folder = root / "arctic_data/data/meta/object_vtemplates/box"
    mesh = trimesh.load_mesh(folder / "bottom.obj", process=False)
    trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False).export(folder / "bottom.obj")
    report = import_arctic(root)
    assert report.parts["box"]["base"]["open_edges"] == 3
    assert report.parts["box"]["base"]["outward_p95_mm"] < 0.1
    assert load_object("box").parts[0].mass == pytest.approx(1.2, rel=0.02)


def test_failed_cut_is_named(release: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh that cannot be cut is named with the last words of its process, and leaves no object."""
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where the cache should be")
    monkeypatch.setenv("ARTIGRASP_CACHE", str(blocked))
    with pytest.raises(UserError, match=r"box: (base|articulated): cannot cut this mesh .*: .*blocked"):
        import_arctic(release, processes=2)
    assert not (tmp_path / "assets" / "objects").exists()
