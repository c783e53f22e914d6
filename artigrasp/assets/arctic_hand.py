"""ARCTIC's hands, of MANO's mean shape: from the release's URDFs or from a user's copy of MANO itself.

Poses in ARCTIC leave MANO's mean pose out. It is kept beside the hands, for whatever poses are imported later.
"""

from pathlib import Path

import numpy as np

from artigrasp.arrays import Array, check_array, load_arrays, save_arrays
from artigrasp.assets.arctic import HAND_NAME, ArcticSource, hand_files
from artigrasp.assets.hand_model import HandModel
from artigrasp.assets.mano_hand import mano_file, read_mano
from artigrasp.assets.urdf_hand import read_urdf_hand
from artigrasp.errors import UserError
from artigrasp.kernels.layout import FINGER_DOF_COUNT, HANDS

MEAN_POSE_FORMAT, MEAN_POSE_VERSION = "artigrasp.mean-pose", 1


def mean_pose_path(destination: Path) -> Path:
    """Where an import keeps the mean pose of both hands."""
    return destination / "hands" / f"{HAND_NAME}_mean_pose.npz"


def find_hand_files(source: ArcticSource, mano: Path | None, side: str) -> list[Path]:
    """The files that a hand and its mean pose are made of; empty if there are none."""
    return hand_files(source, side) if mano is None else [mano_file(mano, side)]


def read_arctic_hand(files: list[Path], side: str, path: Path) -> tuple[HandModel, Array]:
    """A hand, to live at ``path``, and its mean pose, rotation vectors [rad], shape (45,).

    Args:
        files: A URDF and the numbers of the mean pose, or a model file of MANO.
        side: ``"left"`` or ``"right"``.
        path: The USD file that the hand will live in.

    Raises:
        UserError: a file is missing or malformed.
    """
    if len(files) == 1:
        hand, mean_pose = read_mano(files[0], HAND_NAME, side, path)
    else:
        hand, mean_pose = read_urdf_hand(files[0], HAND_NAME, side, path), _read_numbers(files[1])
    if np.abs(mean_pose).max() > np.pi:
        raise UserError(f"{files[-1]}: expected a mean pose within π rad, found {np.abs(mean_pose).max():g}")
    return hand, mean_pose


def _read_numbers(path: Path) -> Array:
    try:
        values = [float(word) for word in path.read_text().split()]
        return check_array("mean pose", values, (FINGER_DOF_COUNT,), np.float64)
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: expected {FINGER_DOF_COUNT} numbers: {error}") from None


def save_mean_pose(path: Path, mean_pose: dict[str, Array]) -> None:
    """Keep the mean pose of both hands."""
    save_arrays(path, MEAN_POSE_FORMAT, MEAN_POSE_VERSION, mean_pose)


def load_mean_pose(path: Path) -> dict[str, Array]:
    """The mean pose of each side, rotation vectors [rad], shape (45,).

    Raises:
        UserError: the file is missing or malformed.
    """
    arrays = load_arrays(path, MEAN_POSE_FORMAT, MEAN_POSE_VERSION)
    try:
        return {side: check_array(side, arrays.get(side, 0), (FINGER_DOF_COUNT,), np.float64) for side in HANDS}
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
