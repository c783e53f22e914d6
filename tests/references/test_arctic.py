"""The import of the real data: counts, conventions and the fit of hands to objects. Needs a user's copy of it."""

import itertools
from collections import Counter
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artigrasp.assets.arctic import LABELS, find_source, object_names
from artigrasp.assets.check import check_asset
from artigrasp.assets.fidelity import Fidelity
from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.object import Mesh, load_object
from artigrasp.cli.list import count_references
from artigrasp.errors import UserError
from artigrasp.kernels.layout import ARTICULATED, DOF_COUNT, HANDS, LINK_COUNT, LINK_PARENTS
from artigrasp.references import arctic
from artigrasp.references.arctic import import_arctic
from artigrasp.references.arctic_labels import read_labelled_frames
from artigrasp.references.arctic_references import NEVER_CLOSED
from artigrasp.references.reference import ReferenceSet, load_references, read_references
from artigrasp.tasks.objects import PAPER_OBJECTS

COUNTS = {
    "box": ((19, 33), (13, 18), 5),
    "espressomachine": ((63, 21), (27, 11), 10),
    "ketchup": ((20, 59), (9, 24), 5),
    "laptop": ((19, 29), (15, 14), 8),
    "microwave": ((10, 22), (4, 11), 3),
    "mixer": ((41, 64), (23, 27), 12),
    "notebook": ((14, 19), (11, 14), 8),
    "waffleiron": ((33, 22), (21, 15), 9),
}
"""The authors' labels of each object: articulating and grasping ones for training and for testing, and image ones."""
IMPORTED = ("box", "laptop")
"""What is imported in earnest for these tests."""


@pytest.mark.parametrize("name", IMPORTED)
def test_every_label_becomes_a_reference(name: str, arctic_assets: Path) -> None:
    """Counts per split and kind are the authors'; the recording's own frames stand beside the image references."""
    references = load_references(name)
    counts = Counter(zip(references.split.tolist(), references.kind.tolist(), strict=True))
    for split, expected in zip(("train", "test"), COUNTS[name], strict=False):
        assert (counts[split, "articulate"], counts[split, "grasp"]) == expected
    images, counterparts = references.select(split="recon"), references.select(split="recon-mocap")
    assert len(images) == len(counterparts) == COUNTS[name][2]
    for field in ("kind", "active", "part", "subject", "sequence", "frame", "object_pose"):
        np.testing.assert_array_equal(getattr(images, field), getattr(counterparts, field), err_msg=field)
    distance = np.linalg.norm(images.wrist_pose_in_part[..., :3] - counterparts.wrist_pose_in_part[..., :3], axis=-1)
    assert 0.005 < np.median(distance[images.active]) < 0.06


@pytest.fixture(scope="module")
def whole(arctic_release: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The release imported as a whole, with one cube for the collision pieces of every part."""
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    pieces = (Mesh(np.array(cube.vertices), np.array(cube.faces)),)
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arctic, "cut_meshes", lambda meshes, processes, progress: None)
        patch.setattr(arctic, "convex_pieces", lambda mesh: pieces)
        patch.setattr(arctic, "measure_fidelity", lambda mesh, pieces: Fidelity(1, 0, 1.0, 0.0, 0.0, 0.0, 0.0))
        report = import_arctic(arctic_release, destination=folder)
    assert report.skipped == [] and len(report.written) == 3 + 2 * 10
    return folder


def test_totals_are_the_papers(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All objects convert; the paper's eight give its 488, 257 and 60 references, and five have no target contact."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(whole))
    counts = count_references()
    assert {split: counts["splits"][split] for split in ("train", "test", "recon", "recon-mocap")} == {
        "train": 488,
        "test": 257,
        "recon": 60,
        "recon-mocap": 60,
    }
    for name, ((arti, grasp), (test_arti, test_grasp), images) in COUNTS.items():
        found = counts["per_object"][name]
        assert found["train"] == {"articulate": arti, "grasp": grasp}
        assert found["test"] == {"articulate": test_arti, "grasp": test_grasp}
        assert sum(found["recon"].values()) == sum(found["recon-mocap"].values()) == images
    assert set(counts["other_objects"]) >= {"phone", "capsulemachine"}
    per_object = {name: load_references(name) for name in (*counts["per_object"], "phone", "capsulemachine")}
    bare = [~each.contacts.any(axis=(1, 2)) & (each.split != "recon-mocap") for each in per_object.values()]
    assert sum(each.sum() for each in bare) == 5
    for name, references in per_object.items():
        model = load_object(name)
        assert ((model.hinge_lower <= references.object_angle) & (references.object_angle <= model.hinge_upper)).all()
        assert (references.object_angle > 0).any() == (name in NEVER_CLOSED)


def test_schemes_leave_no_subject_and_no_recording_in_both_parts(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the paper's split 175 test references share a recording with train; the schemes part all 745 without that."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(whole))
    sizes: Counter[str] = Counter()
    shared = 0
    for name in PAPER_OBJECTS:
        references = load_references(name)
        recordings: dict[str, list[tuple[str, str]]] = {}
        for split in references.splits():
            each = references.select(split=split)
            sizes[split] += len(each)
            recordings[split] = list(zip(each.subject.tolist(), each.sequence.tolist(), strict=True))
            assert {"articulate", "grasp"} <= set(each.kind.tolist()) or split.startswith(("by-subject", "recon"))
        shared += sum(recording in recordings["train"] for recording in recordings["test"])
        assert not set(recordings["by-sequence/train"]) & set(recordings["by-sequence/test"])
        assert {subject for subject, _ in recordings["by-subject/test"]} == {"s5"}
        assert "s5" not in {subject for subject, _ in recordings["by-subject/train"]}
    assert shared == 175
    assert sizes["by-sequence/train"] + sizes["by-sequence/test"] == 745 and 200 < sizes["by-sequence/test"] < 300
    assert (sizes["by-subject/train"], sizes["by-subject/test"]) == (681, 64)


def test_pickled_labels_are_the_compact_file(arctic_release: Path) -> None:
    """For subjects whose recordings are there, the release's own labels give the compact file's frames exactly."""
    source = find_source(arctic_release)
    for name in object_names(source):
        compact, _ = read_labelled_frames(source, name)
        pickled, skipped = read_labelled_frames(replace(source, labels=None), name)
        here = {frame.label.recording.subject for frame in pickled}
        expected = [frame for frame in compact if frame.label.recording.subject in here]
        assert [frame.label for frame in pickled] == [frame.label for frame in expected]
        assert len(pickled) < len(compact) and skipped
        for found, other in zip(pickled, expected, strict=True):
            for field in fields(found)[1:]:
                np.testing.assert_array_equal(
                    getattr(found, field.name), getattr(other, field.name), err_msg=field.name
                )


@pytest.mark.parametrize("name", IMPORTED)
def test_angle_turns_the_part_by_arctics_convention(name: str, arctic_assets: Path) -> None:
    """R_part = R_base · Rz(−ω) with the hinge through the origin, which is how ARCTIC articulates its objects."""
    model = load_object(name)
    for angle in (0.0, 0.7, 3.0):
        position, orientation = model.articulated_pose_in_base(angle)
        np.testing.assert_allclose(position, 0.0, atol=1e-9)
        expected = Rotation.from_euler("z", -angle).as_matrix()
        np.testing.assert_allclose(Rotation.from_quat(orientation).as_matrix(), expected, atol=1e-6)
    assert (model.hinge_lower, model.hinge_upper) == (0.0, pytest.approx(np.pi, abs=1e-6))


@pytest.mark.parametrize("name", IMPORTED)
def test_imported_object_is_sound(name: str, arctic_assets: Path) -> None:
    """The imported object passes the check, with close-fitting pieces and the URDF's masses."""
    report = check_asset(arctic_assets / "objects" / f"{name}.usda")
    assert report.findings == ()
    for part in ("base", "articulated"):
        assert 0.97 < report.facts[f"{part}_pieces_volume_ratio"] < 1.12
    masses = {"box": (0.9642, 0.1274), "laptop": (0.9049, 0.1507)}[name]
    np.testing.assert_allclose([part.mass for part in load_object(name).parts], masses, atol=1e-4)


@pytest.mark.parametrize("side", HANDS)
def test_mano_hand_is_the_releases(side: str, arctic_assets: Path) -> None:
    """Masses are lumped to 16 links, fingers keep the URDF's limits, torques are capped."""
    hand = load_hand("mano", side)
    assert check_asset(hand.path).findings == ()
    assert hand.link_mass.sum() == pytest.approx(0.34965, abs=1e-5) and (hand.link_mass > 1e-3).all()
    limits = {"right": (-0.38, 1.25), "left": (-1.65, 0.12)}[side]
    assert (hand.lower[8], hand.upper[8]) == pytest.approx(limits, abs=1e-6)
    assert hand.upper[:6] == pytest.approx([2.8] * 3 + [np.pi] * 3, abs=1e-6)
    assert hand.effort.tolist() == [100] * 3 + [3] * (DOF_COUNT - 3)
    assert hand.damping.tolist() == [10] * 3 + [1] * (DOF_COUNT - 3)
    assert np.sign(hand.link_offset[1, 0]) == (-1 if side == "right" else 1)


def shape_centres(hand: HandModel, references: ReferenceSet, index: int, side: int) -> np.ndarray:
    """Centres of the links' collision shapes in the frame of the part that the reference is about, shape (16, 3)."""
    pose = references.wrist_pose_in_part[index, side]
    angles = references.finger_angles[index, side].reshape(-1, 3)
    position, turn = np.zeros((LINK_COUNT, 3)), [Rotation.from_quat(pose[3:])] * LINK_COUNT
    position[0] = pose[:3]
    for link in range(1, LINK_COUNT):
        parent = LINK_PARENTS[link]
        position[link] = position[parent] + turn[parent].apply(hand.link_offset[link])
        turn[link] = turn[parent] * Rotation.from_euler("XYZ", angles[link - 1])
    return position + np.stack([turn[link].apply(hand.colliders[link][0].position) for link in range(LINK_COUNT)])


def distance(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Distance of points from a mesh's surface [m]."""
    triangles = mesh.triangles
    nearest = [trimesh.triangles.closest_point(triangles, np.tile(point, (len(triangles), 1))) for point in points]
    return np.linalg.norm(np.array(nearest) - points[:, None], axis=2).min(axis=1)


@pytest.mark.parametrize("name", IMPORTED)
def test_contact_links_are_at_the_surface(name: str, arctic_assets: Path) -> None:
    """Links that should touch are within about their thickness of the part, and nearer than the others."""
    model, references = load_object(name), load_references(name)
    meshes = [trimesh.Trimesh(part.vertices, part.faces, process=False) for part in model.parts]
    hands = [load_hand("mano", side) for side in HANDS]
    touching, free = [], []
    for index, side in itertools.product(range(len(references)), range(len(HANDS))):
        if not references.active[index, side]:
            assert not references.contacts[index, side].any()
            continue
        points = shape_centres(hands[side], references, index, side)
        if references.part[index, side] == ARTICULATED:
            distances = distance(meshes[ARTICULATED], points)
        else:
            distances = np.minimum(*(distance(mesh, points) for mesh in meshes))
        touching.extend(distances[references.contacts[index, side]])
        free.extend(distances[~references.contacts[index, side]])
    assert np.median(touching) < 0.013
    assert np.quantile(touching, 0.9) < 0.025
    assert np.median(free) > 2 * np.median(touching)


@pytest.mark.parametrize("name", IMPORTED)
def test_object_rests_on_the_floor(name: str, arctic_assets: Path) -> None:
    """The lowest vertex is at z = 0 and the base's centre of mass above the origin, on the same side in every split."""
    model, references = load_object(name), load_references(name)
    assert (references.object_angle == 0).all()
    up = Rotation.from_quat(references.object_pose[:, 3:]).as_matrix()[:, 2]
    assert (up @ np.median(up, axis=0) > np.cos(np.radians(2))).all()
    for pose in references.object_pose:
        turn = Rotation.from_quat(pose[3:])
        assert turn.apply(model.vertices_in_base(0.0))[:, 2].min() + pose[2] == pytest.approx(0.0, abs=1e-5)
        np.testing.assert_allclose((turn.apply(model.parts[0].com) + pose[:3])[:2], 0.0, atol=1e-5)


@pytest.mark.parametrize("name", IMPORTED)
def test_lowest_vertex_agrees_with_the_labels(name: str, arctic_release: Path, arctic_assets: Path) -> None:
    """Our mesh in the captured pose reaches down to the vertex that the labels call the lowest."""
    model = load_object(name)
    with np.load(arctic_release / LABELS) as labels:
        rows = np.flatnonzero((labels["object"] == name) & (labels["split"] != "recon"))
        states, expected = labels["object_init"][rows], labels["lowest_vertex_init"][rows, 2]
    for state, height in zip(states, expected, strict=True):
        turn = Rotation.from_rotvec(state[1:4])
        lowest = turn.apply(model.vertices_in_base(state[0]))[:, 2].min() + state[6] / 1000
        assert lowest == pytest.approx(height, abs=5e-3)


def test_importing_again_changes_nothing(arctic_release: Path, arctic_folder: Path) -> None:
    """A second import leaves every file alone, and remakes just what is missing, as it was."""
    report = import_arctic(arctic_release, ["laptop"], arctic_folder)
    assert report.written == [] and len(report.unchanged) == 5
    before = read_references(arctic_folder / "references" / "laptop.npz")
    (arctic_folder / "references" / "laptop.npz").unlink()
    assert import_arctic(arctic_release, ["laptop"], arctic_folder).written == ["references/laptop.npz"]
    after = read_references(arctic_folder / "references" / "laptop.npz")
    for field in fields(ReferenceSet):
        np.testing.assert_array_equal(getattr(after, field.name), getattr(before, field.name), err_msg=field.name)


@pytest.mark.parametrize("name", IMPORTED)
def test_pieces_follow_the_surface(name: str, arctic_release: Path, arctic_folder: Path) -> None:
    """Nineteen in twenty points of the pieces' surface are within a millimetre or so of the mesh, and the reverse."""
    parts = import_arctic(arctic_release, [name], arctic_folder).parts[name]
    for fit in parts.values():
        assert fit["pieces"] <= 32 and fit["open_edges"] == 0
        assert max(fit["outward_median_mm"], fit["inward_median_mm"]) < 0.2
        assert max(fit["outward_p95_mm"], fit["inward_p95_mm"]) < 1.5


def test_unknown_object_is_named(arctic_release: Path, tmp_path: Path) -> None:
    """An object that the release does not have is answered with the nearest one."""
    with pytest.raises(UserError, match="unknown object 'laptob': did you mean 'laptop'"):
        import_arctic(arctic_release, ["laptob"], tmp_path)
    assert not list(tmp_path.iterdir())
