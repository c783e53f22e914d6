"""Fingertips as balls with a pad, and hands that begin near what they are meant for."""

from collections.abc import Sequence

import numpy as np
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_model import MIRROR_POSITION
from artigrasp.assets.hand_surface import core_points
from artigrasp.assets.hand_table import hand_table, put_hands
from artigrasp.kernels import states
from artigrasp.kernels.kinematics import forward_kinematics
from artigrasp.kernels.layout import DOFS, LONG_FINGERS, TIP_LINKS, WRIST_DOF_COUNT
from artigrasp.references.natural_pose import NaturalPose, mirror_fingers
from artigrasp.references.synthesis.intents import THUMB, Intents

PADS = np.array([[-0.2, -0.69, -0.69], *[[0.0, -1.0, 0.0]] * len(LONG_FINGERS)])
"""The way the pad of each fingertip of a right hand faces in the frame of its link, order ``TIP_FINGERS``."""
APPROACH = 0.01
"""How far the fingertips are from what they are meant for, at the start [m]."""
SPREAD = 0.5
"""How much the fingers differ at the start, over how much natural ones do."""
KNUCKLE_SHARES, MIDDLE_SHARE = (0.35, 0.6), 0.62
"""Share of a finger's bend that is at its knuckle, and of what remains that at its middle joint."""


class Fingertips:
    """The fingertips of H hands, order ``TIP_FINGERS``.

    Attributes:
        centre: Middle of the ball in the frame of the tip link [m], shape (H, 5, 3).
        radius: Of the ball [m], shape (H, 5).
        pad: Unit vector in which the pad faces, in that frame, shape (H, 5, 3).
    """

    def __init__(self, hands: Sequence[HandModel]) -> None:
        radius = []
        for hand in hands:
            balls = core_points(hand)
            radius.append([balls.radius[balls.link == link].min() for link in TIP_LINKS])
        offset = np.stack([hand.tip_offset for hand in hands])
        reach = np.linalg.norm(offset, axis=2)
        self.radius = np.array(radius)
        self.centre = offset * ((reach - self.radius) / reach)[..., None]
        pads = PADS / np.linalg.norm(PADS, axis=1, keepdims=True)
        self.pad = np.stack([pads * (MIRROR_POSITION if hand.side == "left" else 1.0) for hand in hands])


def start_poses(intents: Intents, hands: Sequence[HandModel], natural: NaturalPose, seed: int) -> tuple[Array, Array]:
    """Hands that are turned and bent as intended, with their fingertips near what they are meant for.

    Args:
        intents: N intents of H hands.
        hands: The hands.
        natural: What the fingers are like otherwise.
        seed: Of what is drawn.

    Returns:
        Wrist poses in the base's frame [m, quaternion xyzw], shape (N, H, 7), and finger angles [rad], (N, H, 45).
    """
    random = np.random.default_rng(seed)
    angles = np.stack([_fingers(intents.bend[:, hand], natural, random) for hand in range(len(hands))], axis=1)
    for index, hand in enumerate(hands):
        if hand.side == "left":
            angles[:, index] = mirror_fingers(angles[:, index])
    wrist = np.zeros((*intents.bend.shape, 7))
    wrist[..., 3:] = np.stack([_turn(intents, index, hand.side) for index, hand in enumerate(hands)], axis=1)
    tips = Fingertips(hands)
    wanted = intents.target + intents.normal * (tips.radius + APPROACH)[..., None]
    chosen = intents.busy * (np.arange(intents.busy.shape[2]) != THUMB)
    # Where no long finger has anything to do, the hand is put in place by the middle of all of them.
    chosen = np.where(chosen.any(axis=2, keepdims=True), chosen, 1.0)[..., None]
    offset = wanted - tip_centres(wrist, angles, hands, tips)
    wrist[..., :3] = (offset * chosen).sum(axis=2) / chosen.sum(axis=2)
    return wrist, angles


def tip_centres(wrist: Array, angles: Array, hands: Sequence[HandModel], tips: Fingertips) -> Array:
    """Middles of the fingertips of N posed hands, in the frame of the wrist poses [m], shape [N, H, 5, 3]."""
    state = states.hand_state(len(wrist), len(hands), "cpu")
    put_hands(state, wrist, angles)
    wp.launch(forward_kinematics, dim=wrist.shape[:2], inputs=[state, hand_table(hands, "cpu")], device="cpu")
    frames = state.link_pose.numpy()[:, :, list(TIP_LINKS)].astype(np.float64)
    local = np.broadcast_to(tips.centre, (*frames.shape[:3], 3)).reshape(-1, 3)
    turned = Rotation.from_quat(frames[..., 3:].reshape(-1, 4)).apply(local)
    return np.asarray(turned.reshape(*frames.shape[:3], 3) + frames[..., :3])


def _fingers(bend: Array, natural: NaturalPose, random: np.random.Generator) -> Array:
    """Natural fingers of right hands, the long ones bent by so much from palm to pad [rad], shape [N, 45]."""
    drawn = random.normal(size=(len(bend), len(natural.mean)))
    angles = natural.mean + SPREAD * np.linalg.solve(natural.whitening, drawn.T).T
    share = random.uniform(*KNUCKLE_SHARES, len(bend))
    shares = (share, (1 - share) * MIDDLE_SHARE, (1 - share) * (1 - MIDDLE_SHARE))
    fingers = DOFS[WRIST_DOF_COUNT:]
    for finger in LONG_FINGERS:
        for joint, of_bend in enumerate(shares, start=1):
            angles[:, fingers.index(f"{finger}{joint}_rz")] = of_bend * bend
    return angles


def _turn(intents: Intents, index: int, side: str) -> Array:
    """Rotations of the wrists that turn the pads to the surface and the hand across as intended, shape [N, 4]."""
    normal = intents.normal[:, index, THUMB + 2]
    across = intents.across[:, index]
    bend = intents.bend[:, index]
    towards = np.stack([np.sin(bend), -np.cos(bend), np.zeros_like(bend)], axis=1)
    if side == "left":
        towards = towards * MIRROR_POSITION
    thumbwards = np.broadcast_to([0.0, 0.0, 1.0], towards.shape)
    local = np.stack([towards, thumbwards, np.cross(towards, thumbwards)], axis=2)
    world = np.stack([-normal, across, np.cross(-normal, across)], axis=2)
    return np.asarray(Rotation.from_matrix(world @ np.transpose(local, (0, 2, 1))).as_quat())
