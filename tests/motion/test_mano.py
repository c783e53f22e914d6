"""MANO's parameters of a motion: they pose MANO's hand as ours is, and are those that references came from."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.arctic import find_source
from artigrasp.assets.arctic_hand import load_mean_pose, mean_pose_path
from artigrasp.assets.hand import load_hand
from artigrasp.assets.library import import_root
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import FINGER_DOF_COUNT, HANDS, LINK_PARENTS
from artigrasp.motion.file import save_motion
from artigrasp.motion.kinematics import link_poses, pose_object
from artigrasp.motion.mano import export_mano, mano_parameters
from artigrasp.references.arctic_labels import read_labelled_frames
from artigrasp.references.arctic_references import base_pose, make_references
from artigrasp.references.mano_pose import (
    WRIST_FROM_MANO,
    finger_angles,
    mano_translation,
    rotation_vectors,
    wrist_pose,
)
from artigrasp.references.poses import to_poses
from tests.motion.example import example_motion


def test_the_parameters_pose_the_links() -> None:
    """A chain of rotation vectors from the translated wrist joint, as MANO's, puts every link where ours is."""
    motion = example_motion(hands=HANDS)
    hands = [load_hand("open", side) for side in HANDS]
    expected = link_poses(motion, hands)
    poses, translations = mano_parameters(motion)
    for sample in range(len(motion.time)):
        for index, hand in enumerate(hands):
            frames: list[tuple[np.ndarray, Rotation]] = []
            for link, parent in enumerate(LINK_PARENTS):
                turn = Rotation.from_rotvec(poses[sample, index, link])
                if parent < 0:
                    frames.append((translations[sample, index] + WRIST_FROM_MANO[hand.side], turn))
                else:
                    origin, before = frames[parent]
                    frames.append((origin + before.apply(hand.link_offset[link]), before * turn))
            for (position, turn), pose in zip(frames, expected[sample, index], strict=True):
                np.testing.assert_allclose(position, pose[:3], atol=1e-5)
                np.testing.assert_allclose(turn.as_matrix(), Rotation.from_quat(pose[3:]).as_matrix(), atol=1e-5)


@pytest.mark.parametrize("side", HANDS)
def test_parameters_come_back(side: str) -> None:
    """From MANO's parameters to wrist frames and finger angles and back."""
    generator = np.random.default_rng(0)
    vectors = Rotation.random(8 * 15, rng=generator).as_rotvec().reshape(8, FINGER_DOF_COUNT)
    np.testing.assert_allclose(rotation_vectors(finger_angles(vectors)), vectors, atol=1e-9)
    turns, translations = Rotation.random(8, rng=generator).as_rotvec(), generator.normal(size=(8, 3))
    position, turn = wrist_pose(turns, translations, side).as_components()
    np.testing.assert_allclose(mano_translation(position, side), translations)
    np.testing.assert_allclose(turn.as_rotvec(), turns, atol=1e-9)


def test_export_names_what_smplx_takes(tmp_path: Path) -> None:
    """A row per sample of each argument of smplx's MANO, with or without the mean pose; as in the motion file."""
    motion = example_motion(hands=HANDS)
    save_motion(tmp_path / "motion.npz", motion)
    kept = np.load(tmp_path / "motion.npz", allow_pickle=False)
    mean_pose = {"left": np.full(45, -0.1), "right": np.linspace(0, 1, 45)}
    flat = tmp_path / "flat.npz"
    export_mano(motion, flat)
    export_mano(motion, tmp_path / "mean.npz", mean_pose=mean_pose)
    files = [np.load(path, allow_pickle=False) for path in (flat, tmp_path / "mean.npz")]
    assert [bool(each["flat_hand_mean"]) for each in files] == [True, False]
    for hand, side in enumerate(HANDS):
        np.testing.assert_array_equal(files[0][f"{side}_global_orient"], kept["mano_pose"][:, hand, 0])
        np.testing.assert_array_equal(files[0][f"{side}_hand_pose"], kept["mano_pose"][:, hand, 1:].reshape(5, 45))
        np.testing.assert_array_equal(files[0][f"{side}_transl"], kept["mano_translation"][:, hand])
        assert files[0][f"{side}_betas"].shape == (5, 10) and not files[0][f"{side}_betas"].any()
        restored = files[1][f"{side}_hand_pose"] + mean_pose[side]
        np.testing.assert_allclose(restored, files[0][f"{side}_hand_pose"], atol=1e-6)


def test_references_of_arctic_give_its_parameters_back(arctic_release: Path, arctic_assets: Path) -> None:
    """What was imported from MANO's poses of a recording gives these poses, whose hands are relative to the object."""
    model = load_object("box")
    frames, _ = read_labelled_frames(find_source(arctic_release), "box")
    mean_pose = load_mean_pose(mean_pose_path(import_root()))
    references = make_references(model, frames, mean_pose)
    for row in range(0, len(frames), 7):
        frame = frames[row]
        parts = pose_object(to_poses(base_pose(frame.state))[None], frame.state[:1], model)[0]
        for hand, side in enumerate(HANDS):
            part, wrist = parts[references.part[row, hand]], references.wrist_pose_in_part[row, hand]
            turn = Rotation.from_quat(part[3:])
            translation = mano_translation(turn.apply(wrist[:3]) + part[:3], side)
            np.testing.assert_allclose(translation, frame.translation[hand], atol=1e-5)
            assert same_turn(turn * Rotation.from_quat(wrist[3:]), frame.rotation[hand])
            fingers = rotation_vectors(references.finger_angles[row, hand].astype(float)).reshape(-1, 3)
            assert same_turn(Rotation.from_rotvec(fingers), (frame.pose[hand] + mean_pose[side]).reshape(-1, 3))


def same_turn(found: Rotation, expected: np.ndarray) -> bool:
    """Whether rotations are those of rotation vectors, which are not unique, up to rounding."""
    return bool(np.max((found.inv() * Rotation.from_rotvec(expected)).magnitude()) < 1e-4)
