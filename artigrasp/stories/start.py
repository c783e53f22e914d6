"""Where hands and objects of a story are at first."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.assets.object import load_object
from artigrasp.config.story import CloseStep, OpenStep, StoryConfig
from artigrasp.environment.instant import Instant
from artigrasp.errors import UserError
from artigrasp.kernels.layout import DOF_COUNT
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks.sequences import SOFT_FINGERS

_WAITING = {
    # a right hand's fingers point to -x and its palm to -y: forward and down
    "right": Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]),
    "left": Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
}


def check_angles(story: StoryConfig) -> None:
    """Compare the story's hinge angles with how far its objects open.

    Raises:
        UserError: One lies outside; names the key.
    """
    widest = {name: load_object(placed.asset).hinge_upper for name, placed in story.objects.items()}
    asked = [(f"objects.{name}.angle", name, placed.angle) for name, placed in story.objects.items()]
    for index, step in enumerate(story.steps):
        if isinstance(step, OpenStep | CloseStep):
            asked.append((f"steps[{index}].to", step.object, step.to))
    for key, name, angle in asked:
        if not 0 <= angle <= widest[name]:
            expected = f"0 to {widest[name]:.2f} rad, as far as {name} opens"
            raise UserError(f"{key}: expected {expected}, found {angle:g}")


def scatter_objects(story: StoryConfig, shift: float, turn: float, seed: int) -> StoryConfig:
    """The story, its objects standing somewhere near their places; what steps ask for stays.

    Args:
        story: The story.
        shift: Largest distance from an object's place along x and along y [m].
        turn: Largest turn about the vertical from how it should stand [rad].
        seed: Of the uniform draw.
    """
    drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, (len(story.objects), 3)) * [shift, shift, turn]
    objects = {
        name: replace(placed, at=(placed.at[0] + x, placed.at[1] + y), yaw=placed.yaw + yaw)
        for (name, placed), (x, y, yaw) in zip(story.objects.items(), drawn.tolist(), strict=True)
    }
    return replace(story, objects=objects)


def first_instant(story: StoryConfig, references: Sequence[ReferenceSet], sides: Sequence[str]) -> Instant:
    """Objects standing in their places, flat hands waiting over the table with fingers forward and palms down.

    Args:
        story: The story.
        references: A set for each of its objects, which tells how it stands.
        sides: Sides of the hands in the scene.
    """
    places = {"left": story.left_hand, "right": story.right_hand}
    bases = [np.concatenate([places[side], _WAITING[side].as_quat()]) for side in sides]
    poses = []
    for placed, each in zip(story.objects.values(), references, strict=True):
        standing = each.object_pose[0]
        turn = Rotation.from_euler("z", placed.yaw) * Rotation.from_quat(standing[3:])
        poses.append(np.concatenate([placed.at, standing[2:3], turn.as_quat()]))
    hands, objects = len(sides), len(poses)
    still = np.zeros((hands, DOF_COUNT), np.float32)
    gains = SOFT_FINGERS.groups
    return Instant(
        joint_q=still,
        joint_qd=still,
        hand_base=np.array(bases, np.float32),
        home=np.array(bases, np.float32),
        target=still,
        stiffness=np.tile(np.array([each.kp for each in gains], np.float32), (hands, 1)),
        damping=np.tile(np.array([each.kd for each in gains], np.float32), (hands, 1)),
        pose=np.array(poses, np.float32),
        velocity=np.zeros((objects, 6), np.float32),
        hinge_q=np.array([placed.angle for placed in story.objects.values()], np.float32),
        hinge_qd=np.zeros(objects, np.float32),
    )
