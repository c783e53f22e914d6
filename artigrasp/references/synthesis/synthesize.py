"""References without recordings: hands that are fitted to an object's surface from many starts at once."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.config import SynthesisConfig
from artigrasp.kernels.layout import BASE, FINGER_DOF_COUNT, HANDS, LINK_COUNT, WRIST_DOF_COUNT
from artigrasp.references.descent import descend
from artigrasp.references.hand_distance import PartMeshes, pose_parts_in_base
from artigrasp.references.natural_pose import NaturalPose, mirror_fingers
from artigrasp.references.poses import compose_poses, invert_poses, wrist_moves
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.synthesis.energy import SynthesisEnergy
from artigrasp.references.synthesis.fingertips import start_poses
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.intents import draw_intents
from artigrasp.references.synthesis.judgement import Judgement, judge
from artigrasp.references.synthesis.selection import Descriptors, choose_different
from artigrasp.references.synthesis.surface import sample_surface

IDLE_GAP, IDLE_HEIGHT = 0.2, 0.1
"""Where a hand rests that takes no part: so far beside the object and over the table [m]."""
IDLE_TURN = {"left": (0.5, 0.5, 0.5, 0.5), "right": (0.5, -0.5, -0.5, 0.5)}
"""How it is turned in the world: fingers forward (+y), palm down."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """N fitted grips of one kind.

    Attributes:
        references: The grips; links that touch are target contacts.
        judgement: What they are worth before the physics is asked.
        chosen: Rows of sound ones that differ, the best first.
    """

    references: ReferenceSet
    judgement: Judgement
    chosen: NDArray[np.int64]


def synthesize(
    grip: Grip,
    resting: RestingObject,
    hands: tuple[HandModel, HandModel],
    natural: NaturalPose,
    config: SynthesisConfig,
    *,
    most: int,
    device: str = "cpu",
    on_iteration: Callable[[int], None] = lambda iteration: None,
) -> Candidates | None:
    """Fit hands to an object; the same input gives the same result.

    Args:
        grip: What the hands are to do.
        resting: The object.
        hands: Left and right hand.
        natural: Which finger angles are natural.
        config: How many hands, and what weighs what.
        most: Most grips that are chosen.
        device: Warp device.
        on_iteration: Called with the iterations done, for progress.

    Returns:
        The fitted grips, or None if the object has nothing to do this with.
    """
    surface = sample_surface(resting, config.samples, config.seed, device)
    intents = draw_intents(grip, resting, surface, config.candidates * config.draws, config.seed)
    if intents is None:
        return None
    taking = [HANDS.index(side) for side in grip.sides]
    own = [hands[index] for index in taking]
    wrist, fingers = start_poses(intents, own, natural, config.seed)
    meshes = PartMeshes([resting.model], device)

    def energy_of(rows: NDArray[np.int64]) -> SynthesisEnergy:
        start = (wrist[rows], fingers[rows])
        return SynthesisEnergy(grip, intents[rows], start, resting, own, natural, config, meshes)

    best = _best_starts(energy_of, config)
    energy = energy_of(best)
    joint_q = wp.to_torch(energy.posed.hands.joint_q, requires_grad=False)
    end, _, _ = descend(joint_q, energy.evaluate, config.iterations, on_iteration=on_iteration)
    joint_q.copy_(end)
    numbers = end.cpu().numpy().astype(np.float64)
    poses = compose_poses(wrist[best], wrist_moves(numbers))
    references = _references(grip, poses, numbers[..., WRIST_DOF_COUNT:], resting, hands, natural)
    references, judgement = judge(grip, references, resting, hands, energy, device)
    descriptors = Descriptors(poses, references.contacts[:, taking])
    return Candidates(references, judgement, choose_different(descriptors, judgement.energy, judgement.sound, most))


def _best_starts(
    energy_of: Callable[[NDArray[np.int64]], SynthesisEnergy], config: SynthesisConfig
) -> NDArray[np.int64]:
    """Of the intents that are drawn for each candidate, the row of the one that starts with the least energy."""
    first = np.arange(config.candidates)
    rows = [first + draw * config.candidates for draw in range(config.draws)]
    energies = [energy_of(each).evaluate()[0].cpu().numpy() for each in rows]
    return np.asarray(np.argmin(energies, axis=0) * config.candidates + first)


def _references(
    grip: Grip,
    wrist_in_base: Array,
    fingers: Array,
    resting: RestingObject,
    hands: tuple[HandModel, HandModel],
    natural: NaturalPose,
) -> ReferenceSet:
    """Fitted grips as references that touch nothing yet; a hand that takes no part rests beside the object."""
    count = len(fingers)
    part = np.full((count, len(HANDS)), BASE, np.int32)
    active = np.zeros((count, len(HANDS)), bool)
    wrist = np.zeros((count, len(HANDS), 7))
    angles = np.zeros((count, len(HANDS), FINGER_DOF_COUNT))
    parts = pose_parts_in_base(resting.model, np.full(count, resting.angle))
    for index, side in enumerate(HANDS):
        if side in grip.sides:
            column = grip.sides.index(side)
            part[:, index], active[:, index] = grip.part, True
            wrist[:, index] = compose_poses(invert_poses(parts[:, grip.part]), wrist_in_base[:, column])
            angles[:, index] = fingers[:, column]
        else:
            wrist[:, index] = _idle_wrist(resting, side)
            angles[:, index] = natural.mean if side == "right" else mirror_fingers(natural.mean)
    return ReferenceSet(
        object=resting.model.name,
        hand=hands[0].name,
        kind=np.full(count, grip.kind),
        split=np.full(count, "train"),
        active=active,
        part=part,
        wrist_pose_in_part=wrist.astype(np.float32),
        finger_angles=angles.astype(np.float32),
        contacts=np.zeros((count, len(HANDS), LINK_COUNT), bool),
        object_pose=np.tile(resting.pose, (count, 1)).astype(np.float32),
        object_angle=np.full(count, resting.angle, np.float32),
        source=np.full(count, ""),
    )


def _idle_wrist(resting: RestingObject, side: str) -> Array:
    """In the base's frame: position [m], quaternion xyzw, shape (7,)."""
    base = resting.pose[None]
    vertices = resting.model.vertices_in_base(resting.angle)
    reach = float(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1).max()) + IDLE_GAP
    middle = compose_poses(base, np.concatenate([vertices.mean(axis=0), [0.0, 0.0, 0.0, 1.0]])[None])[0, :2]
    aside = reach if side == "right" else -reach
    world = np.array([middle[0] + aside, middle[1], IDLE_HEIGHT, *IDLE_TURN[side]])
    pose: Array = compose_poses(invert_poses(base), world[None])[0]
    return pose
