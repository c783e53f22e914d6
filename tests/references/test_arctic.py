"""The import of ARCTIC: counts, conventions and the fit of hands to objects. Needs a user's copy of the data."""

import itertools
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artigrasp.assets import arctic as assets
from artigrasp.assets.check import check_asset
from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.object import Mesh, load_object
from artigrasp.errors import UserError
from artigrasp.kernels.layout import ARTICULATED, DOF_COUNT, HANDS, LINK_COUNT, LINK_PARENTS
from artigrasp.references import arctic_labels
from artigrasp.references.arctic import import_arctic
from artigrasp.references.reference import ReferenceSet, load_references

COUNTS = {
    "box": {("train", "articulate"): 19, ("train", "grasp"): 33, ("test", "articulate"): 13, ("test", "grasp"): 18},
    "laptop": {("train", "articulate"): 19, ("train", "grasp"): 29, ("test", "articulate"): 15, ("test", "grasp"): 14},
}
RECONSTRUCTED = {"box": 5, "laptop": 8}
PAPER_OBJECTS = ("box", "espressomachine", "ketchup", "laptop", "microwave", "mixer", "notebook", "waffleiron")


@pytest.mark.parametrize("name", COUNTS)
def test_every_label_becomes_a_reference(name: str, arctic_assets: Path) -> None:
    """Counts per split and kind are the paper's."""
    references = load_references(name)
    counts = Counter(zip(references.split.tolist(), references.kind.tolist(), strict=True))
    assert sum(count for (split, _), count in counts.items() if split == "recon") == RECONSTRUCTED[name]
    assert {key: count for key, count in counts.items() if key[0] != "recon"} == COUNTS[name]


def test_totals_are_the_papers(arctic_release: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All ten objects convert; the paper's eight give 488, 257 and 60 references, and five have no target contact."""
    corners = np.array(list(itertools.product((0.0, 0.1), repeat=3)))
    cube = trimesh.convex.convex_hull(corners)
    piece = Mesh(np.array(cube.vertices), np.array(cube.faces))
    monkeypatch.setattr(assets, "convex_pieces", lambda mesh: (piece,))
    report = import_arctic(arctic_release, destination=tmp_path)
    assert report.skipped == () and len(report.written) == 2 + 2 * 10
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    per_object = {name: load_references(name) for name in assets.object_names(arctic_release)}
    totals = sum((Counter(per_object[name].split.tolist()) for name in PAPER_OBJECTS), Counter())
    assert totals == {"train": 488, "test": 257, "recon": 60}
    assert sum((~references.contacts.any(axis=(1, 2))).sum() for references in per_object.values()) == 5
    for name, references in per_object.items():
        model = load_object(name)
        assert ((model.hinge_lower <= references.object_angle) & (references.object_angle <= model.hinge_upper)).all()
        assert (references.object_angle > 0).any() == (name in arctic_labels.NEVER_CLOSED)


@pytest.mark.parametrize("name", COUNTS)
def test_angle_turns_the_part_by_arctics_convention(name: str, arctic_assets: Path) -> None:
    """R_part = R_base · Rz(−ω) with the hinge through the origin, which is how ARCTIC articulates its objects."""
    model = load_object(name)
    for angle in (0.0, 0.7, 3.0):
        position, orientation = model.articulated_pose_in_base(angle)
        np.testing.assert_allclose(position, 0.0, atol=1e-9)
        expected = Rotation.from_euler("z", -angle).as_matrix()
        np.testing.assert_allclose(Rotation.from_quat(orientation).as_matrix(), expected, atol=1e-6)
    assert (model.hinge_lower, model.hinge_upper) == (0.0, pytest.approx(np.pi, abs=1e-6))


@pytest.mark.parametrize("name", COUNTS)
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


@pytest.mark.parametrize("name", COUNTS)
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


@pytest.mark.parametrize("name", COUNTS)
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


@pytest.mark.parametrize("name", COUNTS)
def test_lowest_vertex_agrees_with_the_labels(name: str, arctic_release: Path, arctic_assets: Path) -> None:
    """Our mesh in the captured pose reaches down to the vertex that the labels call the lowest."""
    model, labels = load_object(name), arctic_labels.read_labels(arctic_release)
    with np.load(arctic_release / arctic_labels.LABELS) as archive:
        expected = archive["lowest_vertex_init"][:, 2]
    for row in np.flatnonzero((labels["object"] == name) & (labels["split"] != "recon")):
        state = labels["object_init"][row]
        turn = Rotation.from_rotvec(state[1:4])
        lowest = turn.apply(model.vertices_in_base(state[0]))[:, 2].min() + state[6] / 1000
        assert lowest == pytest.approx(expected[row], abs=5e-3)


def test_importing_again_changes_nothing(arctic_release: Path, arctic_folder: Path) -> None:
    """A second import leaves every file alone, and remakes just what is missing."""
    calls: list[tuple[str, int, int]] = []
    report = import_arctic(arctic_release, ["laptop"], arctic_folder, lambda *call: calls.append(call))
    assert report.written == () and len(report.unchanged) == 4
    assert calls[0][1:] == (0, 4) and calls[-1][1:] == (4, 4)
    before = (arctic_folder / "references" / "laptop.npz").read_bytes()
    (arctic_folder / "references" / "laptop.npz").unlink()
    assert import_arctic(arctic_release, ["laptop"], arctic_folder).written == ("references/laptop.npz",)
    assert len((arctic_folder / "references" / "laptop.npz").read_bytes()) == len(before)


def test_sequence_that_is_missing_is_skipped(arctic_release: Path, arctic_assets: Path) -> None:
    """An image reference whose motion capture is not there is left out with a reason; all others stay."""
    labels = arctic_labels.read_labels(arctic_release)
    labels["subject"] = np.where(labels["split"] == "recon", "s99", labels["subject"])
    mean_pose = {side: arctic_labels.read_mean_pose(arctic_release, side) for side in HANDS}
    references, skipped = arctic_labels.convert_references(arctic_release, load_object("box"), labels, mean_pose)
    assert len(skipped) == RECONSTRUCTED["box"] and all("s99" in line for line in skipped)
    assert len(references) == sum(COUNTS["box"].values())


def test_bad_source_is_named(tmp_path: Path) -> None:
    """A folder of another layout is refused before anything is written."""
    with pytest.raises(UserError, match="expected a folder with rsc/arctic/<object>/"):
        import_arctic(tmp_path, destination=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_unknown_object_is_named(arctic_release: Path, tmp_path: Path) -> None:
    """An object that the release does not have is answered with the nearest one."""
    with pytest.raises(UserError, match="unknown object 'laptob': did you mean 'laptop'"):
        import_arctic(arctic_release, ["laptob"], tmp_path)
    assert not list(tmp_path.iterdir())
