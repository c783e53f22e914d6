"""Author references of the lidded box: how a right hand may take hold of its lid.

    python -m tools.author_box_references [FILE] [--seed S]

writes ``assets_usd/references/lidded-box.npz``; the same seed writes the same file.

A candidate begins as an intent drawn at random: at which edge of the lid, from which direction, with which fingers, how
far curled, and whether the fingers go below the rim with the thumb above (``hook``) or the other way round (``cover``).
A hand is fitted to it. A sound fit is tried in simulation with random offsets of the hinge-following prior (the 12
synergies) and kept if at least two of 32 open the box. The bare prior, which is the PD+IK baseline, has no say in that.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.action_columns import action_count
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import trial_worlds
from artigrasp.kernels.layout import ARTICULATED, BASE, HANDS, LINK_COUNT, LONG_FINGERS, TIP_FINGERS, TIP_LINKS
from artigrasp.references.reference import ReferenceSet, save_references
from artigrasp.tasks import get_task
from tools.hand_fitting import LAST_JOINT_SHARE, MOTIONS, TABLE_CLEARANCE, HandFitter, Intent, Pose

OBJECT, HAND = "lidded-box", "open"
CANDIDATE_COUNT, KEPT_PER_KIND, TEST_EVERY = 80, 9, 3
"""Candidates of all kinds, references that are kept of each kind, and which of them are for testing: every third."""
TRIAL_COUNT, TRIAL_SPREAD, TRIAL_GOAL, LEAST_OPENED = 32, 0.7, 1.0, 2
"""Trials of a candidate, deviation of their offsets in units of the synergies, goal [rad] and least successes."""
CONTACT_DISTANCE, DEEPEST = 0.006, 0.004
"""Links this near to the lid should touch it; no link of a sound fit is deeper in the box than that [m]."""


@dataclass(frozen=True)
class Edge:
    """A stretch of the lid's rim: its middle, the way inwards, half its length and how far the lid overhangs [m]."""

    middle: tuple[float, float]
    inwards: tuple[float, float]
    half_length: float
    overhang: float


EDGES = {
    "front": Edge((0.0, -0.110), (0.0, 1.0), 0.09, 0.020),
    "right": Edge((0.128, -0.04), (-1.0, 0.0), 0.05, 0.008),
}
HOOK_RANGES = ((-55, 15), (-10, 50), (0, 50))
COVER_RANGES = ((-35, 10), (-30, 15), (-50, -5))
"""Of the hand's pitch, its roll and the pitch of the fingertips [deg]: where they point, upwards positive."""
THUMB_RANGES = {
    "thumb1_x": (0, 40),
    "thumb1_y": (-15, 15),
    "thumb1_z": (0, 25),
    "thumb2_curl": (0, 30),
    "thumb3_curl": (0, 30),
}
"""Of the motions of a relaxed thumb [deg]."""
KINDS = [(grip, edge) for grip in ("hook", "cover") for edge in EDGES]
LEFT_WRIST = np.array([-0.32, -0.12, 0.10, 0.5, 0.5, 0.5, 0.5])
"""Where the left hand rests, fingers forward and palm down: position [m] and quaternion xyzw in the base."""
ROW = {"thumb": 0.035, "index": 0.027, "middle": 0.004, "ring": -0.018, "pinky": -0.040}
"""Where the fingertips are in their row, towards the thumb [m]."""


def draw_intent(random: np.random.Generator, grip: str, edge_name: str, lid: Array, tip_radii: Array) -> Intent:
    """Somebody's idea of how to open the box.

    Args:
        random: What is drawn from.
        grip: ``"hook"`` or ``"cover"``.
        edge_name: One of ``EDGES``.
        lid: Two corners of the lid [m], shape (2, 3).
        tip_radii: Of the fingertips [m], shape (5,).
    """
    hooks, edge = grip == "hook", EDGES[edge_name]
    inwards, up = np.array([*edge.inwards, 0.0]), np.array([0.0, 0.0, 1.0])
    along = np.cross(inwards, up)

    # The palm faces up to hook, down to cover, and the fingers inwards; then the hand turns to where the forearm comes
    # from: beside the edge (yaw), above or below it (pitch), and about itself (roll).
    yaw = random.uniform(*((-20, 50) if edge_name == "front" else (-50, 10)))
    pitch, roll, tip_pitch = random.uniform(*zip(*(HOOK_RANGES if hooks else COVER_RANGES), strict=True))
    x, y = -inwards, -up if hooks else up
    flat = Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=1))
    turn = Rotation.from_rotvec(np.radians(yaw) * up) * Rotation.from_rotvec(np.radians(pitch) * along)
    wrist = turn * flat * Rotation.from_euler("x", roll, degrees=True)

    busy_fingers = random.choice([2, 3, 4], p=[0.15, 0.25, 0.6])
    busy = np.array([True, *(index < busy_fingers for index in range(len(LONG_FINGERS)))])
    busy[0] = not hooks or random.random() < 0.85
    below = np.array([not hooks, *[hooks] * len(LONG_FINGERS)])
    across = (wrist.apply([0.0, 0.0, 1.0]) @ along) * np.array([ROW[finger] for finger in TIP_FINGERS])
    across += random.uniform(-1, 1) * edge.half_length
    across[0] += random.uniform(-0.015, 0.015)
    depth = np.where(below, random.uniform(0.3, 0.8) * edge.overhang, random.uniform(0.010, 0.060))
    press = random.uniform(-0.001, 0.002)
    height = np.where(below, lid[0, 2] - tip_radii + press, lid[1, 2] + tip_radii - press)
    tips = np.outer(across, along) + np.outer(depth, inwards) + np.outer(height, up) + [*edge.middle, 0.0]
    return Intent(
        name=f"{grip} {edge_name}",
        wrist=wrist,
        motions=relaxed_motions(random, tip_pitch - pitch if hooks else pitch - tip_pitch),
        tips=tips,
        axes=np.stack([along, inwards, up]),
        freedom=np.where(busy[:, None], [0.010, 0.004, 0.0007], np.inf),
        pads=np.where(below[:, None], up, -up),
    )


def relaxed_motions(random: np.random.Generator, bend: float) -> Array:
    """Fingers that are bent by about so much from palm to tip [deg], order ``MOTIONS`` [rad]."""
    motions: dict[str, float] = {}
    knuckle_share = random.uniform(0.25, 0.5)
    for finger in LONG_FINGERS:
        knuckle = knuckle_share * max(bend, 10.0) + random.normal(0, 5)
        curl = (1 - knuckle_share) * max(bend, 10.0) / (1 + LAST_JOINT_SHARE) + random.normal(0, 5)
        motions |= {f"{finger}_knuckle": knuckle, f"{finger}_curl": curl, f"{finger}_spread": random.normal(0, 3)}
    for name, (lower, upper) in THUMB_RANGES.items():
        motions[name] = random.uniform(lower, upper)
    return np.radians([motions[name] for name in MOTIONS])


def is_sound(pose: Pose, intent: Intent) -> bool:
    """Whether every busy fingertip touches the lid, and nothing is deep inside the box or too low."""
    touches = pose.gaps[list(TIP_LINKS), ARTICULATED] < CONTACT_DISTANCE
    return bool(touches[intent.busy].all() and pose.gaps.min() > -DEEPEST and pose.height > 0.5 * TABLE_CLEARANCE)


def reference_set(poses: Sequence[Pose], splits: Sequence[str], sources: Sequence[str]) -> ReferenceSet:
    """Right-hand articulation references; the left hand rests beside the box."""
    count, right = len(poses), HANDS.index("right")
    wrist = np.tile(LEFT_WRIST, (count, len(HANDS), 1))
    angles = np.zeros((count, len(HANDS), len(poses[0].finger_angles)))
    contacts = np.zeros((count, len(HANDS), LINK_COUNT), bool)
    wrist[:, right] = [pose.wrist for pose in poses]
    angles[:, right] = [pose.finger_angles for pose in poses]
    contacts[:, right] = [pose.gaps[:, ARTICULATED] < CONTACT_DISTANCE for pose in poses]
    is_right = np.arange(len(HANDS)) == right
    return ReferenceSet(
        object=OBJECT,
        hand=HAND,
        kind=np.full(count, "articulate"),
        split=np.array(splits),
        active=np.tile(is_right, (count, 1)),
        part=np.tile(np.where(is_right, ARTICULATED, BASE), (count, 1)).astype(np.int32),
        wrist_pose_in_part=wrist.astype(np.float32),
        finger_angles=angles.astype(np.float32),
        contacts=contacts,
        object_pose=np.tile(np.array([0, 0, 0, 0, 0, 0, 1], np.float32), (count, 1)),
        object_angle=np.zeros(count, np.float32),
        source=np.array(sources),
    )


class RandomOffsets:
    """A controller that decides at random."""

    name = "random-offsets"
    hand = None
    rollout_count = 0

    def __init__(self, seed: int) -> None:
        """Draw from a generator with this seed."""
        self.task = get_task("right-fixed-synergy")
        self._random = np.random.default_rng(seed)

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Offsets in units of their scales."""
        shape = (*features.shape[:2], action_count(self.task.action))
        return self._random.normal(0.0, TRIAL_SPREAD, shape).astype(np.float32)


def count_opened(references: ReferenceSet, seed: int) -> NDArray[np.int64]:
    """How many of ``TRIAL_COUNT`` random offsets open the box from each reference, shape [R]."""
    controller = RandomOffsets(seed)
    worlds = trial_worlds([references], [TRIAL_GOAL] * TRIAL_COUNT)
    environment = Environment(controller.task, [references], worlds, seed=seed, noise=False)
    run_episode(environment, controller)
    return np.asarray(environment.episode_summary()["success"].reshape(-1, TRIAL_COUNT).sum(axis=1), np.int64)


def main() -> None:
    """Write the references."""
    parser = argparse.ArgumentParser(description="Author the references of the lidded box.")
    default = Path(__file__).parents[1] / "assets_usd" / "references" / f"{OBJECT}.npz"
    parser.add_argument("file", type=Path, nargs="?", default=default)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    box = load_object(OBJECT)
    # Each part is the block that encloses it: a closed box has no inside to be in.
    solids = [np.stack([part.vertices.min(axis=0), part.vertices.max(axis=0)]) for part in box.parts]
    fitter = HandFitter(load_hand(HAND, "right"), solids)
    poses, candidates = [], []
    for candidate in range(CANDIDATE_COUNT):
        random = np.random.default_rng([arguments.seed, candidate])
        intent = draw_intent(random, *_kind(candidate), solids[ARTICULATED], fitter.tip_radii)
        pose = fitter.fit(intent)
        if is_sound(pose, intent):
            poses.append(pose)
            candidates.append(candidate)
    sources = [f"author_box_references seed {arguments.seed} candidate {candidate}" for candidate in candidates]
    opened = count_opened(reference_set(poses, ["trial"] * len(poses), sources), arguments.seed)

    kept, splits = [], []
    kept_of_kind = dict.fromkeys(KINDS, 0)
    for index, candidate in enumerate(candidates):
        kind = _kind(candidate)
        if opened[index] >= LEAST_OPENED and kept_of_kind[kind] < KEPT_PER_KIND:
            kept.append(index)
            splits.append("test" if kept_of_kind[kind] % TEST_EVERY == TEST_EVERY - 1 else "train")
            kept_of_kind[kind] += 1
    save_references(arguments.file, reference_set([poses[i] for i in kept], splits, [sources[i] for i in kept]))
    for index, split in zip(kept, splits, strict=True):
        grip, edge = _kind(candidates[index])
        print(f"{sources[index]}: {split}, {grip} {edge}, {opened[index]} of {TRIAL_COUNT} offsets open it")
    print(f"{arguments.file}: {len(kept)} references of {len(poses)} sound fits of {CANDIDATE_COUNT} candidates")


def _kind(candidate: int) -> tuple[str, str]:
    return KINDS[candidate % len(KINDS)]


if __name__ == "__main__":
    main()
