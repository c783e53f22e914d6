"""Author grasps of the lidded box: how two hands may take it between them to carry it.

    python -m tools.author_box_grasps [FILE] [--seed S]

adds them to ``assets_usd/references/lidded-box.npz``, in place of those that it has; the same seed writes the same
file. Run ``author_box_references.py`` first.

A candidate begins as an intent drawn at random: where the fingers of the right hand lie along the box's wall, how the
hand is turned, and where the thumb rests on the lid. A hand is fitted to it, and the left is its mirror image. Every
sound fit is kept, whether or not anything can lift the box with it.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.hand_model import MIRROR_FINGERS, MIRROR_POSITION, MIRROR_ROTATION
from artigrasp.assets.object import load_object
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS, TIP_FINGERS, TIP_LINKS
from artigrasp.references.reference import ReferenceSet, join_references, read_references, save_references
from tools.author_box_references import CONTACT_DISTANCE, DEEPEST, HAND, OBJECT, ROW, relaxed_motions
from tools.hand_fitting import TABLE_CLEARANCE, HandFitter, Intent, Pose

CANDIDATE_COUNT, KEPT, TEST_EVERY = 24, 12, 3
"""Candidates, grasps that are kept, and which of them are for testing: every third."""
FORWARD_PALM_INWARDS = Rotation.from_matrix([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Right wrist beside the wall at +x: fingers forward (+y), palm to the wall, thumb up."""
MIRROR = np.concatenate([MIRROR_POSITION, MIRROR_ROTATION, [1.0]])
"""Factors that mirror poses across x = 0."""


def draw_intent(random: np.random.Generator, wall: Array, lid: Array, tip_radii: Array) -> Intent:
    """Somebody's idea of how to take the box between both hands.

    Args:
        random: What is drawn from.
        wall: Two corners of the box's base [m], shape (2, 3).
        lid: Two corners of the lid [m], shape (2, 3).
        tip_radii: Of the fingertips [m], shape (5,).
    """
    turn = Rotation.from_euler("zxy", random.uniform((-10, -25, -8), (10, 15, 8)), degrees=True)
    wrist = turn * FORWARD_PALM_INWARDS
    press = random.uniform(0.0, 0.002)
    tips = np.outer([ROW[finger] for finger in TIP_FINGERS], wrist.apply([0.0, 0.0, 1.0]))
    tips += [0.0, random.uniform(-0.01, 0.06), random.uniform(0.055, 0.070)]
    tips[:, 0] = wall[1, 0] + tip_radii - press
    tips[0] = lid[1] + [random.uniform(-0.035, -0.01), 0.0, tip_radii[0] - press]
    tips[0, 1] = tips[1, 1] - random.uniform(0.0, 0.04)
    on_wall, on_lid = [0.0007, 0.012, 0.008], [0.012, 0.015, 0.0007]
    return Intent(
        name="clamp",
        wrist=wrist,
        motions=relaxed_motions(random, random.uniform(5, 25)),
        tips=tips,
        axes=np.eye(3),
        freedom=np.array([on_lid, *[on_wall] * 4]),
        pads=np.array([[0.0, 0.0, -1.0], *[[-1.0, 0.0, 0.0]] * 4]),
    )


def is_sound(pose: Pose) -> bool:
    """Whether at least three fingertips touch the wall, and nothing is deep inside the box or too low."""
    touches = pose.gaps[list(TIP_LINKS)[1:], BASE] < CONTACT_DISTANCE
    return bool(touches.sum() >= 3 and pose.gaps.min() > -DEEPEST and pose.height > 0.5 * TABLE_CLEARANCE)


def grasp_set(poses: Sequence[Pose], sources: Sequence[str]) -> ReferenceSet:
    """Grasps with both hands, every third of them for testing."""
    count = len(poses)
    right = np.array([pose.wrist for pose in poses])
    angles = np.array([pose.finger_angles for pose in poses])
    touching = np.array([(pose.gaps < CONTACT_DISTANCE).any(axis=1) for pose in poses])
    return ReferenceSet(
        object=OBJECT,
        hand=HAND,
        kind=np.full(count, "grasp"),
        split=np.where(np.arange(count) % TEST_EVERY == TEST_EVERY - 1, "test", "train"),
        active=np.ones((count, len(HANDS)), bool),
        part=np.full((count, len(HANDS)), BASE, np.int32),
        wrist_pose_in_part=np.stack([right * MIRROR, right], axis=1).astype(np.float32),
        finger_angles=np.stack([angles * MIRROR_FINGERS, angles], axis=1).astype(np.float32),
        contacts=np.stack([touching, touching], axis=1),
        object_pose=np.tile(np.array([0, 0, 0, 0, 0, 0, 1], np.float32), (count, 1)),
        object_angle=np.zeros(count, np.float32),
        source=np.array(sources),
    )


def main() -> None:
    """Write the grasps beside the articulations."""
    parser = argparse.ArgumentParser(description="Author grasps of the lidded box.")
    default = Path(__file__).parents[1] / "assets_usd" / "references" / f"{OBJECT}.npz"
    parser.add_argument("file", type=Path, nargs="?", default=default)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    solids = [np.stack([part.vertices.min(axis=0), part.vertices.max(axis=0)]) for part in load_object(OBJECT).parts]
    fitter = HandFitter(load_hand(HAND, "right"), solids)
    poses: list[Pose] = []
    sources: list[str] = []
    for candidate in range(CANDIDATE_COUNT):
        random = np.random.default_rng([arguments.seed, candidate])
        pose = fitter.fit(draw_intent(random, solids[BASE], solids[ARTICULATED], fitter.tip_radii))
        if is_sound(pose) and len(poses) < KEPT:
            poses.append(pose)
            sources.append(f"author_box_grasps seed {arguments.seed} candidate {candidate}")
    articulations = read_references(arguments.file).select(kind="articulate")
    save_references(arguments.file, join_references([articulations, grasp_set(poses, sources)]))
    print(f"{arguments.file}: {len(poses)} grasps, the last of them from {sources[-1]}")


if __name__ == "__main__":
    main()
