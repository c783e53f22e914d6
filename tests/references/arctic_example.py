"""Small made-up copies of ARCTIC in every layout that an import knows. Nothing in them comes from the data."""

import pickle
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import trimesh

from artigrasp.assets.hand import Box, Capsule, HandModel, load_hand
from artigrasp.kernels.layout import DOF_COUNT, HANDS, LINK_PARENTS, LINKS, TIP_FINGERS, TIP_LINKS, WRIST_DOF_COUNT

FRAMES = 8
SUBJECTS = ("s1", "s2", "s5")
SEQUENCES = ("box_grab_01", "box_use_02")
TABLE_MM = (40.0, -80.0, 1000.0)

LABELS: dict[str, list[tuple[int, str, int, int, str]]] = {
    "train_set": [
        (1, "box_use_02", 1, 3, "right_arti"),
        (1, "box_grab_01", 0, 2, "two_grasp"),
        (2, "box_use_02", 2, 5, "right_grasp"),
    ],
    "test_set": [(1, "box_use_02", 4, 6, "left_grasp"), (5, "box_use_02", 5, 4, "right_arti")],
    "test_recon": [(5, "box_use_02", 5, 4, "right_arti"), (5, "box_grab_01", 1, 7, "two_grasp")],
}
"""Subject, sequence, initial frame, frame of the hands and kind of every label."""


def boxes() -> tuple[trimesh.Trimesh, trimesh.Trimesh]:
    """Base and lid of the object in metres: two boxes of 1.2 and 0.24 litres, one above the other."""
    base = trimesh.creation.box((0.12, 0.10, 0.10))
    lid = trimesh.creation.box((0.12, 0.02, 0.10))
    base.apply_translation((0.06, 0.05, 0.0))
    lid.apply_translation((0.06, 0.11, 0.0))
    return base, lid


def states(seed: int, camera: bool = False) -> np.ndarray:
    """States of the object, shape (FRAMES, 7): angle, rotation vector, millimetres."""
    random = np.random.default_rng(seed)
    result = np.zeros((FRAMES, 7), np.float32)
    result[:, 0] = np.linspace(0.0, 1.5, FRAMES)
    result[:, 1:4] = random.normal(size=3) * 0.1 + (0.0 if camera else np.array([np.pi / 2, 0.0, 0.0]))
    result[:, 4:] = np.array(TABLE_MM) + random.normal(size=(FRAMES, 3)) + (2000.0 if camera else 0.0)
    return result


def hands(seed: int) -> dict[str, dict[str, np.ndarray]]:
    """MANO parameters of both hands, FRAMES each."""
    random = np.random.default_rng(seed)
    return {
        side: {
            "rot": random.normal(size=(FRAMES, 3)).astype(np.float32),
            "pose": (0.1 * random.normal(size=(FRAMES, 45))).astype(np.float32),
            "trans": (np.array(TABLE_MM) / 1000 + 0.1 * random.normal(size=(FRAMES, 3))).astype(np.float32),
            "shape": np.zeros(10, np.float32),
            "fitting_err": np.zeros(FRAMES),
        }
        for side in HANDS
    }


def contacts(seed: int) -> np.ndarray:
    """Contacts of one hand, shape (FRAMES, 3, 16): articulated part, base, either."""
    result = (np.random.default_rng(seed).random((FRAMES, 3, 16)) < 0.3).astype(float)
    result[:, 2] = np.maximum(result[:, 0], result[:, 1])
    return result


def seed_of(subject: str, sequence: str) -> int:
    """A number of its own for each recording."""
    return 10 * int(subject[1:]) + SEQUENCES.index(sequence)


def save(path: Path, value: Any) -> None:
    """Write an .npy file, which holds pickles where the value is no array."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, value, allow_pickle=True)


def write_release(root: Path, labels: bool = True) -> Path:
    """The authors' release: ``rsc/`` with hands, one object, sequences and pickled labels."""
    arctic, mano = root / "rsc" / "arctic" / "box", root / "rsc" / "mano_double"
    arctic.mkdir(parents=True)
    mano.mkdir()
    for name, mesh in zip(("bottom", "top"), boxes(), strict=True):
        mesh.export(arctic / f"{name}_watertight_tiny.obj")
    (arctic / "box.urdf").write_text(object_urdf())
    for side in HANDS:
        (mano / f"{side[0]}hand_mano.urdf").write_text(hand_urdf(load_hand("open", side)))
        (mano / f"{side}_pose_mean.txt").write_text(" ".join(f"{0.01 * i:.3f}" for i in range(45)))
    for subject in SUBJECTS:
        for sequence in SEQUENCES:
            write_recording(root, subject, sequence, camera=False)
            if subject == "s5":
                write_recording(root, subject, sequence, camera=True)
    if labels:
        for folder, rows in LABELS.items():
            names = ("seq_num", "seq_name", "init_frame", "grasp_frame", "kind")
            listed = [dict(zip(names, (row[0], row[1], *row[2:]), strict=True)) | {"obj_name": "box"} for row in rows]
            save(mano / "grasp_label" / "final_labels" / folder / "box.npy", np.array(listed, object))
    return root


def write_recording(root: Path, subject: str, sequence: str, camera: bool) -> None:
    """One recording of the release."""
    seed, folder = seed_of(subject, sequence), f"{subject}_recon" if camera else subject
    mano = root / "rsc" / "mano_double"
    save(root / "rsc" / "arctic" / "box" / folder / f"{sequence}.object.npy", states(seed, camera))
    save(mano / folder / f"{sequence}.mano.npy", hands(seed))
    for index, side in enumerate("lr"):
        touching = contacts(seed + index)
        save(mano / ("contact_recon" if camera else "contact") / subject / f"{sequence}_a_{side}.npy", touching)


def write_labelled_frames(path: Path) -> Path:
    """The compact file: what the release has of its labelled frames."""
    split_of = {"train_set": "train", "test_set": "test", "test_recon": "recon"}
    columns: dict[str, list[Any]] = {}
    for folder, rows in LABELS.items():
        for number, sequence, initial, frame, kind in rows:
            subject, camera = f"s{number}", folder == "test_recon"
            seed = seed_of(subject, sequence)
            shown = hands(seed)
            row: dict[str, Any] = {"split": split_of[folder], "subject": subject, "sequence": sequence}
            row |= {"object": "box", "kind": kind, "init_frame": initial, "grasp_frame": frame}
            row |= {"object_init": states(seed, camera)[initial], "object_grasp": states(seed, camera)[frame]}
            for index, side in enumerate(HANDS):
                row |= {f"{side}_{name}": shown[side][name][frame] for name in ("rot", "pose", "trans")}
                row[f"{side}_contact"] = contacts(seed + index)[frame].astype(np.uint8)
            for name, value in row.items():
                columns.setdefault(name, []).append(value)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **{name: np.array(values) for name, values in columns.items()})
    return path


def write_labelled_release(root: Path) -> Path:
    """Write the release with its labelled frames in one file."""
    write_release(root, labels=False)
    write_labelled_frames(root / "labelled_frames.npz")
    return root


def write_download(root: Path, objects: tuple[str, ...] = ("box", "scissors"), parted: bool = True) -> Path:
    """The official download: templates in millimetres, as two meshes or as one with a file of parts, and recordings."""
    for name in objects:
        folder = root / "arctic_data" / "data" / "meta" / "object_vtemplates" / name
        folder.mkdir(parents=True)
        base, lid = boxes()
        for mesh in (base, lid):
            mesh.apply_scale(1000.0)
        if parted:
            base.export(folder / "bottom.obj")
            lid.export(folder / "top.obj")
        both = trimesh.util.concatenate([lid, base])
        both.export(folder / "mesh.obj")
        parts = np.repeat([1, 0], [len(lid.vertices), len(base.vertices)])
        (folder / "parts.json").write_text("[\n" + ",\n".join(map(str, parts)) + "\n]\n")
    for subject in SUBJECTS:
        folder = root / "arctic_data" / "data" / "raw_seqs" / f"s{int(subject[1:]):02d}"
        for sequence in SEQUENCES:
            seed = seed_of(subject, sequence)
            save(folder / f"{sequence}.mano.npy", hands(seed))
            save(folder / f"{sequence}.object.npy", states(seed))
    return root


def object_urdf() -> str:
    """The URDF of the object, with the release's names, and masses that differ from those of water."""
    robot = ElementTree.Element("robot", name="box")
    for name, mesh, mass in zip(("bottom", "top"), boxes(), (0.9, 0.1), strict=True):
        inertia = mesh.moment_inertia * mass / mesh.volume
        add_inertial(ElementTree.SubElement(robot, "link", name=name), mass, mesh.center_mass, inertia)
    joint = ElementTree.SubElement(robot, "joint", name="rotation", type="revolute")
    ElementTree.SubElement(joint, "origin", rpy="0 0 0", xyz="0 0 0")
    ElementTree.SubElement(joint, "axis", xyz="0 0 -1.0")
    ElementTree.SubElement(joint, "limit", lower="0", upper="2.5", effort="1000")
    ElementTree.SubElement(joint, "dynamics", damping="0.05", friction="0.0001")
    return ElementTree.tostring(robot, encoding="unicode")


def hand_urdf(hand: HandModel) -> str:
    """The URDF of a hand as the release writes it: a ball joint is three hinges, the mass on the first of its links."""
    robot = ElementTree.Element("robot", name=hand.side)
    wrist = [f"{hand.side}_wrist_0{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    joints = wrist + [f"{hand.side}_{link}_{axis}" for link in LINKS[1:] for axis in "xyz"]
    for index, name in enumerate(joints):
        joint = ElementTree.SubElement(robot, "joint", name=name)
        link = 0 if index < WRIST_DOF_COUNT else 1 + (index - WRIST_DOF_COUNT) // 3
        first = index >= WRIST_DOF_COUNT and index % 3 == 0
        ElementTree.SubElement(joint, "origin", xyz=words(hand.link_offset[link] if first else np.zeros(3)))
        ElementTree.SubElement(joint, "limit", lower=str(hand.lower[index]), upper=str(hand.upper[index]))
        ElementTree.SubElement(joint, "dynamics", damping=str(hand.damping[index]))
    assert len(joints) == DOF_COUNT
    for index, link in enumerate(LINKS):
        body = ElementTree.SubElement(robot, "link", name=f"{hand.side}_{link}")
        add_inertial(body, hand.link_mass[index], hand.link_com[index], hand.link_inertia[index])
        last = ElementTree.SubElement(robot, "link", name=f"{hand.side}_{'wrist_rz' if index == 0 else f'{link}_z'}")
        for collider in hand.colliders[index]:
            collision = ElementTree.SubElement(last, "collision")
            ElementTree.SubElement(collision, "origin", xyz=words(collider.position))
            geometry = ElementTree.SubElement(collision, "geometry")
            if isinstance(collider, Capsule):
                ElementTree.SubElement(geometry, "capsule", radius=str(collider.radius), length=str(collider.length))
            elif isinstance(collider, Box):
                ElementTree.SubElement(geometry, "box", size=words(collider.extents))
    for finger, offset in zip(TIP_FINGERS, hand.tip_offset, strict=True):
        tip = ElementTree.SubElement(robot, "joint", name=f"{hand.side}_{finger}_tip")
        ElementTree.SubElement(tip, "origin", xyz=words(offset))
    return ElementTree.tostring(robot, encoding="unicode")


def add_inertial(link: ElementTree.Element, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    """Give a link its mass."""
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=words(com))
    ElementTree.SubElement(inertial, "mass", value=str(mass))
    entries = {f"i{a}{b}": str(inertia[i, j]) for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i <= j}
    ElementTree.SubElement(inertial, "inertia", entries)


def words(values: np.ndarray) -> str:
    """Numbers as URDF writes them."""
    return " ".join(str(float(value)) for value in values)


class Ch:
    """Stands for the class in which MANO's files wrap arrays."""

    def __init__(self, x: np.ndarray) -> None:
        self.x = x


class csc_matrix:
    """Stands for the class of sparse matrices in MANO's files."""

    def __init__(self, dense: np.ndarray) -> None:
        columns = [np.flatnonzero(column) for column in dense.T]
        self.data = np.concatenate([column[rows] for column, rows in zip(dense.T, columns, strict=True)])
        self.indices = np.concatenate(columns).astype(np.int32)
        self.indptr = np.concatenate([[0], np.cumsum([len(rows) for rows in columns])]).astype(np.int32)
        self._shape = dense.shape


Ch.__module__, csc_matrix.__module__ = "chumpy.ch", "scipy.sparse.csc"


def mano_model() -> dict[str, Any]:
    """A right hand in the form of MANO's model: the open hand's joints, and eight points of skin around each."""
    hand = load_hand("open", "right")
    joints = np.zeros((len(LINKS), 3))
    joints[0] = (0.09, 0.006, 0.006)
    for link, parent in enumerate(LINK_PARENTS[1:], start=1):
        joints[link] = joints[parent] + hand.link_offset[link]
    ends = dict(zip(TIP_LINKS, hand.tip_offset, strict=True))
    corners = 0.01 * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    vertices, weights, regressor = [], [], np.zeros((len(LINKS), 9 * len(LINKS)))
    for link in range(len(LINKS)):
        far = joints[link] + ends.get(link, np.array([-0.03, 0.0, 0.0]))
        regressor[link, len(vertices) : len(vertices) + 8] = 1 / 8
        vertices += [*(joints[link] + corners), far]
        weights += [np.eye(len(LINKS))[link]] * 9
    parents = np.array([2**32 - 1, *LINK_PARENTS[1:]], np.uint32)
    return {
        "v_template": Ch(np.array(vertices)),
        "weights": np.array(weights),
        "J_regressor": csc_matrix(regressor),
        "hands_mean": 0.01 * np.arange(45.0),
        "kintree_table": np.stack([parents, np.arange(len(LINKS), dtype=np.uint32)]),
        "shapedirs": Ch(np.zeros((len(vertices), 3, 10))),
        "bs_style": "lbs",
    }


def write_mano(path: Path, model: dict[str, Any], protocol: int = 2) -> Path:
    """Write a model as MANO's files are written, by classes that the reader has not got."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        _ForeignPickler(file, protocol).dump(model)
    return path


class _ForeignPickler(pickle._Pickler):  # type: ignore[name-defined]
    """Names classes without looking whether they are where they say."""

    def save_global(self, obj: Any, name: str | None = None) -> None:
        if obj in (Ch, csc_matrix):
            self.write(pickle.GLOBAL + f"{obj.__module__}\n{obj.__name__}\n".encode())
            self.memoize(obj)
        else:
            super().save_global(obj, name)

    dispatch = pickle._Pickler.dispatch | {type: save_global}  # type: ignore[attr-defined]
