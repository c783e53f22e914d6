"""A small made-up motion for the tests."""

import numpy as np

from artigrasp.kernels.layout import ARTICULATED, DOF_COUNT, FINGER_DOF_COUNT, LINK_COUNT, PARTS
from artigrasp.motion.file import Motion, MotionReference


def random_poses(generator: np.random.Generator, *shape: int) -> np.ndarray:
    """Poses (position [m], quaternion xyzw) within a metre of the origin, shape ``[*shape, 7]``."""
    quaternion = generator.normal(size=(*shape, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return np.concatenate([generator.uniform(-1, 1, (*shape, 3)), quaternion], axis=-1)


def example_motion(
    *, hands: tuple[str, ...] = ("right",), hand: str = "open", object: str = "lidded-box", sample_count: int = 5
) -> Motion:
    """Random poses and angles at 100 Hz: valid, and different everywhere."""
    generator = np.random.default_rng(0)
    hand_count = len(hands)
    return Motion(
        time=np.arange(sample_count) / 100,
        hands=hands,
        hand=hand,
        object=object,
        hand_base=random_poses(generator, hand_count),
        joint_q=generator.uniform(-0.5, 0.5, (sample_count, hand_count, DOF_COUNT)),
        object_pose=random_poses(generator, sample_count),
        hinge_angle=np.linspace(0, 1, sample_count),
        contact_force=generator.normal(size=(sample_count, hand_count, LINK_COUNT, len(PARTS), 3)),
        phases=np.asarray(["approach"] * (sample_count // 2) + ["articulate"] * (sample_count - sample_count // 2)),
        target_angle=1.25,
        reference=MotionReference(
            part=np.full(hand_count, ARTICULATED),
            wrist_pose_in_part=random_poses(generator, hand_count),
            finger_angles=generator.uniform(-0.5, 0.5, (hand_count, FINGER_DOF_COUNT)),
        ),
        metrics={"aae": 0.25, "sd": 0.01},
        provenance={"task": "right-fixed", "policy": "zero"},
    )
