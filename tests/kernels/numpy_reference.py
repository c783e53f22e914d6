"""The kernels' mathematics once more, in double precision with NumPy and SciPy and written independently of them.

A frame is a pair ``(R, p)`` of rotation matrices [..., 3, 3] and origins [..., 3].
"""

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.kernels.layout import ARTICULATED, FEATURE_COUNT, LINK_PARENTS, LINKS, TIP_LINKS, feature_slice
from tests.kernels.samples import Sample

Frame = tuple[Array, Array]

CONTACT_THRESHOLD = 1e-3
WEIGHTS = {
    "keypoint": 3.0,
    "fingertip": 12.0,
    "pose": 0.2,
    "contact": 1.5,
    "force": 1.5,
    "force_cap": 5.0,
    "hand_linear_velocity": 0.5,
    "hand_angular_velocity": 0.4,
    "object_velocity": 0.2,
    "angle": 1.5,
    "displacement": 0.3,
}
"""The paper's weights, but none equal to another of the same term, so that a mix-up shows."""


def euler_matrix(angles: Array) -> Array:
    """Intrinsic XYZ angles [..., 3] to matrices."""
    return Rotation.from_euler("XYZ", angles.reshape(-1, 3)).as_matrix().reshape(*angles.shape[:-1], 3, 3)


def rotation_vector(matrix: Array) -> Array:
    """Matrices [..., 3, 3] to rotation vectors."""
    return Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(matrix.shape[:-1])


def frame(pose: Array) -> Frame:
    """Poses [..., 7] to frames."""
    matrix = Rotation.from_quat(pose[..., 3:].reshape(-1, 4)).as_matrix()
    return matrix.reshape(*pose.shape[:-1], 3, 3), pose[..., :3]


def turned(matrix: Array, vector: Array) -> Array:
    """Matrices times vectors."""
    return np.einsum("...ij,...j->...i", matrix, vector)


def compose(a: Frame, b: Frame) -> Frame:
    """Frame b, given in frame a, in the frame that a is given in."""
    return a[0] @ b[0], a[1] + turned(a[0], b[1])


def inverse(a: Frame) -> Frame:
    """The inverse of a frame."""
    transposed = np.swapaxes(a[0], -1, -2)
    return transposed, -turned(transposed, a[1])


def hand_frames(root: Frame, finger_angles: Array, link_offset: Array, tip_offset: Array) -> tuple[list[Frame], Array]:
    """Frames of the 16 links and the 21 keypoints [..., 21, 3] of hands whose wrist frame is ``root``.

    Args:
        root: [W, H] wrist frames.
        finger_angles: [W, H, 45].
        link_offset, tip_offset: [H, 16, 3] and [H, 5, 3].
    """
    links = [root]
    identity = np.broadcast_to(np.eye(3), root[0].shape)
    for link in range(1, len(LINKS)):
        matrix = euler_matrix(finger_angles[..., 3 * (link - 1) : 3 * link])
        at_joint = compose(links[LINK_PARENTS[link]], (identity, np.broadcast_to(link_offset[:, link], root[1].shape)))
        links.append(compose(at_joint, (matrix, np.zeros(root[1].shape))))
    tips = [links[link][1] + turned(links[link][0], tip_offset[:, tip]) for tip, link in enumerate(TIP_LINKS)]
    return links, np.stack([link[1] for link in links] + tips, axis=-2)


def forward_kinematics(sample: Sample) -> tuple[list[Frame], Array]:
    """Link frames and keypoints in the world."""
    wrist = (euler_matrix(sample.joint_q[..., 3:6]), sample.joint_q[..., :3])
    return hand_frames(
        compose(frame(sample.hand_base), wrist), sample.joint_q[..., 6:], sample.link_offset, sample.tip_offset
    )


def wrist_velocity(sample: Sample) -> tuple[Array, Array]:
    """Linear and angular velocity of the wrist in the world, from the columns of the Jacobian."""
    base = frame(sample.hand_base)[0]
    x, y = sample.joint_q[..., 3], sample.joint_q[..., 4]
    zero = np.zeros_like(x)
    axes = np.stack(
        [
            np.stack([zero + 1, zero, zero], -1),
            np.stack([zero, np.cos(x), np.sin(x)], -1),
            np.stack([np.sin(y), -np.sin(x) * np.cos(y), np.cos(x) * np.cos(y)], -1),
        ],
        axis=-1,
    )
    return turned(base, sample.joint_qd[..., :3]), turned(base @ axes, sample.joint_qd[..., 3:6])


def part_frames(sample: Sample, angle: Array) -> Frame:
    """[W, 2] frames of both parts in the world at a hinge angle [W]."""
    base = frame(sample.pose)
    turn = Rotation.from_rotvec(sample.hinge_axis * angle[:, None]).as_matrix()
    shift = sample.hinge_origin - turned(turn, sample.hinge_origin)
    lid = compose(base, (turn, shift))
    return np.stack([base[0], lid[0]], axis=1), np.stack([base[1], lid[1]], axis=1)


def of_manipulated_part(sample: Sample, values: Array) -> Array:
    """[W, 2, ...] values per part to [W, H, ...] values of the part that each hand manipulates."""
    return values[np.arange(sample.world_count)[:, None], sample.part]


def part_frame(sample: Sample) -> Frame:
    """[W, H] frames of the manipulated parts."""
    matrix, origin = part_frames(sample, sample.hinge_q)
    return of_manipulated_part(sample, matrix), of_manipulated_part(sample, origin)


def part_velocity(sample: Sample) -> tuple[Array, Array]:
    """[W, H] linear velocity of the manipulated parts' origins and angular velocity, world frame."""
    base_matrix, base_origin = frame(sample.pose)
    linear, angular = sample.velocity[:, :3], sample.velocity[:, 3:]
    axis = turned(base_matrix, sample.hinge_axis)
    hinge = base_origin + turned(base_matrix, sample.hinge_origin)
    hinge_velocity = linear + np.cross(angular, hinge - base_origin)
    lid_angular = angular + axis * sample.hinge_qd[:, None]
    lid_origin = part_frames(sample, sample.hinge_q)[1][:, ARTICULATED]
    # The hinge point belongs to both parts.
    lid_linear = hinge_velocity + np.cross(lid_angular, lid_origin - hinge)
    return (
        of_manipulated_part(sample, np.stack([linear, lid_linear], axis=1)),
        of_manipulated_part(sample, np.stack([angular, lid_angular], axis=1)),
    )


def contact_strength(sample: Sample) -> Array:
    """[W, H, 16] force between each link and the part that counts, or both parts' magnitudes added."""
    magnitude = np.linalg.norm(sample.contact_force, axis=-1)
    chosen = sample.contact_part[..., None]
    one_part = np.where(chosen == ARTICULATED, magnitude[..., 1], magnitude[..., 0])
    return np.where(chosen < 0, magnitude.sum(-1), one_part)


def keypoint_errors(sample: Sample) -> Array:
    """[W, H, 21, 3] from the keypoints to their goals, in the manipulated part's frame."""
    matrix, origin = part_frame(sample)
    relative = forward_kinematics(sample)[1] - origin[..., None, :]
    return sample.keypoint_in_part - np.einsum("whji,whkj->whki", matrix, relative)


def wrist_rotation_error(sample: Sample) -> Array:
    """[W, H, 3] the turn, in the part's frame, that takes the wrist to its goal."""
    wrist_in_part = compose(inverse(part_frame(sample)), forward_kinematics(sample)[0][0])
    goal = frame(sample.wrist_pose_in_part)[0]
    return rotation_vector(goal @ np.swapaxes(wrist_in_part[0], -1, -2))


def hinge_block(sample: Sample) -> Array:
    """[W, H, 9] the block ``hinge_in_wrist``."""
    wrist = forward_kinematics(sample)[0][0]
    base_matrix, base_origin = frame(sample.pose)
    axis = np.broadcast_to(turned(base_matrix, sample.hinge_axis)[:, None], wrist[1].shape)
    point = (base_origin + turned(base_matrix, sample.hinge_origin))[:, None]
    # The foot of the perpendicular: the point of the axis that is nearest to the wrist.
    along = np.sum((wrist[1] - point) * axis, axis=-1, keepdims=True)
    to_axis = point + along * axis - wrist[1]
    distance = np.linalg.norm(to_axis, axis=-1, keepdims=True)
    to_wrist = np.swapaxes(wrist[0], -1, -2)
    masses = np.broadcast_to(sample.part_mass[:, None, ::-1], (*distance.shape[:-1], 2))
    return np.concatenate([turned(to_wrist, axis), turned(to_wrist, to_axis / distance), distance, masses], axis=-1)


def features(sample: Sample) -> Array:
    """[W, H, 279] the whole feature vector."""
    part = part_frame(sample)
    wrist = forward_kinematics(sample)[0][0]
    to_wrist, to_part = np.swapaxes(wrist[0], -1, -2), np.swapaxes(part[0], -1, -2)
    wrist_linear, wrist_angular = wrist_velocity(sample)
    part_linear, part_angular = part_velocity(sample)
    part_in_wrist = compose(inverse(wrist), part)
    hands = sample.part.shape
    contact = contact_strength(sample) > CONTACT_THRESHOLD
    blocks = {
        "finger_angles": sample.joint_q[..., 6:],
        "finger_velocities": sample.joint_qd[..., 6:],
        "link_forces": np.linalg.norm(sample.contact_force.sum(axis=3), axis=-1),
        "wrist_velocity_in_part": np.concatenate([turned(to_part, wrist_linear), turned(to_part, wrist_angular)], -1),
        "part_pose_in_wrist": np.concatenate(
            [
                part_in_wrist[1],
                rotation_vector(part_in_wrist[0]),
                np.broadcast_to(sample.hinge_q[:, None, None], (*hands, 1)),
            ],
            axis=-1,
        ),
        "part_velocity_in_wrist": np.concatenate(
            [
                turned(to_wrist, part_linear - wrist_linear),
                turned(to_wrist, part_angular - wrist_angular),
                np.broadcast_to(sample.hinge_qd[:, None, None], (*hands, 1)),
            ],
            axis=-1,
        ),
        "hinge_in_wrist": hinge_block(sample),
        "pose_error": np.concatenate(
            [wrist_rotation_error(sample), sample.finger_angles - sample.joint_q[..., 6:]], axis=-1
        ),
        "keypoint_error_in_part": keypoint_errors(sample).reshape(*hands, -1),
        "contact_goal": np.concatenate([sample.contacts, sample.contacts - contact], axis=-1),
        "angle_error": np.broadcast_to((sample.angle - sample.hinge_q)[:, None, None], (*hands, 1)),
    }
    result = np.full((*hands, FEATURE_COUNT), np.nan)
    for name, block in blocks.items():
        result[..., feature_slice(name)] = block
    return result


def reward_terms(sample: Sample, object_mass: Array) -> dict[str, Array]:
    """[W, H] each weighted reward term by name."""
    square = (keypoint_errors(sample) ** 2).sum(-1)
    pose_error = np.concatenate([wrist_rotation_error(sample), sample.finger_angles - sample.joint_q[..., 6:]], -1)
    strength = contact_strength(sample)
    wanted = sample.contacts.sum(-1)
    made = (sample.contacts * (strength > CONTACT_THRESHOLD)).sum(-1)
    force = (sample.contacts * strength).sum(-1)
    linear, angular = wrist_velocity(sample)
    object_speed = (sample.velocity**2).sum(-1) + sample.hinge_qd**2
    displacement = ((sample.pose[:, :3] - sample.start_object_pose[:, :3]) ** 2).sum(-1)
    terms = {
        "keypoint": -WEIGHTS["keypoint"] * square[..., :16].sum(-1) - WEIGHTS["fingertip"] * square[..., 16:].sum(-1),
        "pose": -WEIGHTS["pose"] * np.linalg.norm(pose_error, axis=-1),
        "contact": WEIGHTS["contact"] * np.divide(made, wanted, out=np.zeros_like(made), where=wanted > 0),
        "force": WEIGHTS["force"] * np.minimum(force, WEIGHTS["force_cap"] * object_mass[:, None]),
        "hand_velocity": -WEIGHTS["hand_linear_velocity"] * (linear**2).sum(-1)
        - WEIGHTS["hand_angular_velocity"] * (angular**2).sum(-1),
        "object_velocity": -WEIGHTS["object_velocity"] * object_speed[:, None],
        "angle": -WEIGHTS["angle"] * np.abs(sample.angle - sample.hinge_q)[:, None],
        "displacement": -WEIGHTS["displacement"] * displacement[:, None],
    }
    return {name: term * sample.active for name, term in terms.items()}
