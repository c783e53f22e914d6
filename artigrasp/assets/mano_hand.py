"""The hand of MANO's mean shape, from a user's copy of the model (``MANO_RIGHT.pkl``, ``MANO_LEFT.pkl``).

The model file gives the joints of the mean shape, the skin, which link moves which part of it, and the mean pose.
Collision shapes and masses are fitted to the skin; what the file does not know, joint limits, damping, armature and
effort, is the open hand's, whose links and axes are the same.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array, check_array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_model import MIRROR_FINGERS, Box, Capsule, Collider, HandModel, mirror
from artigrasp.assets.mass import Body, body_of_mesh
from artigrasp.assets.object_model import Mesh
from artigrasp.errors import UserError
from artigrasp.kernels.layout import FINGER_DOF_COUNT, LINK_COUNT, LINK_PARENTS, LINKS, TIP_LINKS
from artigrasp.restricted_pickle import read_pickle

CLASSES = ("chumpy.*", "scipy.sparse.*")
"""What MANO's files are made of besides arrays."""
DENSITY = 1000.0
"""Of the hand [kg/m³], as in the ArtiGrasp release."""
HAND_LENGTH = (0.1, 0.3)
"""Between which lengths a hand is, from its wrist joint to the tip of its middle finger [m]."""
PALM_QUANTILE = 0.05
"""Share of the palm's skin that sticks out of its box on each side."""

_LARGEST_MATRIX = 10_000_000
"""Numbers in a matrix: MANO's has 12,448."""


@dataclass(frozen=True, eq=False)
class ManoModel:
    """What is needed of MANO's mean shape, in MANO's frame.

    Attributes:
        joints: The links' origins [m], shape (16, 3).
        vertices: The skin [m], shape (V, 3).
        link: The link that moves each vertex most, shape (V,).
        mean_pose: Rotation vectors of the finger joints in the mean pose [rad], shape (45,).
    """

    joints: Array
    vertices: Array
    link: NDArray[np.int64]
    mean_pose: Array


def mano_file(path: Path, side: str) -> Path:
    """The model file of a side; where there is only that of the other side, that one.

    Args:
        path: One file, or the folder that holds one or both of them or has them in ``models/``.
        side: ``"left"`` or ``"right"``.

    Raises:
        UserError: there is none.
    """
    if path.is_file():
        return path
    other = "left" if side == "right" else "right"
    for name in (f"MANO_{side.upper()}.pkl", f"MANO_{other.upper()}.pkl"):
        for folder in (path, path / "models"):
            if (folder / name).is_file():
                return folder / name
    raise UserError(f"{path}: expected MANO_RIGHT.pkl or MANO_LEFT.pkl, found none")


def read_mano(model_path: Path, name: str, side: str, path: Path) -> tuple[HandModel, Array]:
    """The hand of a side and its mean pose, rotation vectors [rad], shape (45,), from a model file of either side.

    MANO's hands are mirror images of each other: a file of the other side does.

    Args:
        model_path: The model file.
        name: Name of the new hand.
        side: ``"left"`` or ``"right"``.
        path: The USD file that the new hand will live in.

    Raises:
        UserError: the model file is missing, holds anything but plain data, or no hand.
    """
    model = _read_model(model_path)
    # A right hand's fingers point to -x.
    found_side = "right" if model.joints[0, 0] > model.joints[1:, 0].mean() else "left"
    hand, mean_pose = replace(_hand(model, found_side), name=name, path=path), model.mean_pose
    if found_side != side:
        hand, mean_pose = mirror(hand, path), mean_pose * MIRROR_FINGERS
    return hand, mean_pose


def _read_model(path: Path) -> ManoModel:
    data = read_pickle(path, CLASSES)
    try:
        if not isinstance(data, dict):
            raise ValueError("expected a dictionary, found none")
        sizes: dict[str, int] = {}
        vertices = check_array("v_template", _array(data, "v_template"), ("V", 3), np.float64, sizes)
        weights = check_array("weights", _array(data, "weights"), ("V", LINK_COUNT), np.float64, sizes)
        mean_pose = check_array("hands_mean", _array(data, "hands_mean"), (FINGER_DOF_COUNT,), np.float64)
        regressor = check_array("J_regressor", _array(data, "J_regressor"), (LINK_COUNT, "V"), np.float64, sizes)
        parents = check_array("kintree_table", _array(data, "kintree_table"), (2, LINK_COUNT), np.int64)[0]
        if parents[1:].tolist() != list(LINK_PARENTS[1:]):
            raise ValueError(f"kintree_table: expected the links {', '.join(LINKS)}, found parents {parents.tolist()}")
        model = ManoModel(regressor @ vertices, vertices, weights.argmax(axis=1), mean_pose)
        length = float(np.linalg.norm(vertices - model.joints[0], axis=1).max())
        if not HAND_LENGTH[0] < length < HAND_LENGTH[1]:
            raise ValueError(f"v_template: expected a hand of {HAND_LENGTH[0]} to {HAND_LENGTH[1]} m, found {length:g}")
        # Four points at least make a solid of each link.
        if (bare := np.flatnonzero(np.bincount(model.link, minlength=LINK_COUNT) < 4)).size:
            raise ValueError(f"weights: expected at least 4 vertices that {LINKS[bare[0]]} moves most, found fewer")
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
    return model


def _array(data: dict[str, Any], name: str) -> Any:
    """An entry as an array: it may be one, or hold one, or the columns of a sparse matrix."""
    value = data.get(name)
    if isinstance(value, dict) and {"data", "indices", "indptr"} <= set(value):
        shape = value.get("_shape", value.get("shape"))
        is_pair = isinstance(shape, tuple | list) and [type(size) for size in shape] == [int, int]
        if shape is None or not is_pair or min(shape) < 0 or shape[0] * shape[1] > _LARGEST_MATRIX:
            raise ValueError(f"{name}: expected the shape of a sparse matrix, found {shape}")
        numbers = check_array(f"{name}.data", value["data"], ("N",), np.float64)
        rows = check_array(f"{name}.indices", value["indices"], ("N",), np.int64)
        starts = check_array(f"{name}.indptr", value["indptr"], (shape[1] + 1,), np.int64)
        matrix = csc_array((numbers, rows, starts), shape=tuple(shape))
        matrix.check_format()
        return matrix.toarray()
    if isinstance(value, dict):
        value = value.get("x")
    if not isinstance(value, np.ndarray):
        raise ValueError(f"{name}: expected an array, found none")
    # Vertex numbers and parents are unsigned, with a mark that no signed number has.
    return value.astype(np.int64) if value.dtype.kind == "u" else value


def _hand(model: ManoModel, side: str) -> HandModel:
    offset = np.zeros((LINK_COUNT, 3))
    offset[1:] = model.joints[1:] - model.joints[list(LINK_PARENTS[1:])]
    skin = [model.vertices[model.link == link] - model.joints[link] for link in range(LINK_COUNT)]
    tips = {link: skin[link][np.linalg.norm(skin[link], axis=1).argmax()] for link in TIP_LINKS}
    bones = {LINK_PARENTS[link]: offset[link] for link in range(LINK_COUNT) if LINK_PARENTS[link] > 0} | tips
    colliders: list[tuple[Collider, ...]] = [(_palm(skin[0]),)]
    colliders += [(_phalanx(bones[link], skin[link]),) for link in range(1, LINK_COUNT)]
    bodies = [_tissue(vertices) for vertices in skin]
    return replace(
        load_hand("open", side),
        link_offset=offset,
        tip_offset=np.stack([tips[link] for link in TIP_LINKS]),
        link_mass=np.array([body.mass for body in bodies]),
        link_com=np.stack([body.com for body in bodies]),
        link_inertia=np.stack([body.inertia for body in bodies]),
        colliders=tuple(colliders),
    )


def _tissue(vertices: Array) -> Body:
    hull = trimesh.convex.convex_hull(vertices)
    solid = Mesh(np.array(hull.vertices), np.array(hull.faces))
    return body_of_mesh(solid, (solid,), DENSITY)


def _palm(skin: Array) -> Box:
    low, high = np.quantile(skin, (PALM_QUANTILE, 1 - PALM_QUANTILE), axis=0)
    return Box((low + high) / 2, np.array([0.0, 0.0, 0.0, 1.0]), high - low)


def _phalanx(bone: Array, skin: Array) -> Capsule:
    """A capsule as thick as the skin, from the joint to one radius before the bone's end."""
    length = float(np.linalg.norm(bone))
    axis = bone / length
    radius = min(float(np.median(np.linalg.norm(np.cross(skin, axis), axis=1))), 0.45 * length)
    turn = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_quat(canonical=True)
    return Capsule((length - radius) / 2 * axis, turn, radius, length - radius)
