"""What a left hand sees and does, as its mirror image: so one policy, made for right hands, acts for both.

The link frames of the two hands are mirror images of each other in x = 0. The frame of the manipulated part is mirrored
in the plane through its origin that is perpendicular to the hinge, so that the hinge keeps its axis and the sense in
which it opens. Shifts are mirrored; turns, which have a sense, are mirrored and reversed. Mirroring twice changes
nothing.
"""

import functools

import torch

from artigrasp.assets.hand_model import MIRROR_POSITION, MIRROR_ROTATION
from artigrasp.config import ActionConfig
from artigrasp.environment.action_columns import synergy_directions
from artigrasp.kernels.layout import DOF_COUNT, FEATURE_COUNT, FINGER_DOF_COUNT, feature_slice

_SHIFT, _TURN = (tuple(each.tolist()) for each in (MIRROR_POSITION, MIRROR_ROTATION))
"""Signs of a shift and of a turn along the axes of a link; the angles of a joint go like turns."""

_PART_TURN = slice(feature_slice("part_pose_in_wrist").start + 3, feature_slice("part_pose_in_wrist").start + 6)
_HINGE = slice(feature_slice("hinge_in_wrist").start, feature_slice("hinge_in_wrist").start + 3)


def mirror_features(features: torch.Tensor) -> torch.Tensor:
    """Features of the other hand in the mirrored world, both of shape [..., 279]."""
    axis = hinge_axis_in_part(features)
    mirrored = features * _feature_signs().to(features)
    for columns, sign in _part_vectors():
        vectors = features[..., columns].reshape(*features.shape[:-1], -1, 3)
        mirrored[..., columns] = sign * _reflect(vectors, axis.unsqueeze(-2)).flatten(-2)
    mirrored[..., _PART_TURN] = _mirror_part_turn(features[..., _PART_TURN], axis)
    return mirrored


def mirror_actions(actions: torch.Tensor, features: torch.Tensor, config: ActionConfig) -> torch.Tensor:
    """Actions of the other hand in the mirrored world.

    Args:
        actions: [..., action] of a hand.
        features: [..., 279] that either of the two hands saw; they tell the hinge's axis, which both see alike.
        config: What the action means.
    """
    mirrored = actions * _action_signs(config).to(actions)
    directions = synergy_directions(config.synergy)
    for name, sign in (("wrist_tx", 1.0), ("wrist_rx", -1.0)):
        if name in directions:
            axis, first = hinge_axis_in_part(features), directions.index(name)
            mirrored[..., first : first + 3] = sign * _reflect(actions[..., first : first + 3], axis)
    return mirrored


def hinge_axis_in_part(features: torch.Tensor) -> torch.Tensor:
    """Unit direction of the hinge in the part's frame, [..., 3]; z, as ARCTIC's, where the features hide the hinge."""
    in_wrist, turn = features[..., _HINGE], features[..., _PART_TURN]
    angle = torch.linalg.vector_norm(turn, dim=-1, keepdim=True)
    about = turn / angle.clamp_min(1e-9)
    along = (about * in_wrist).sum(-1, keepdim=True) * about
    # the part's turn, undone
    in_part = along + torch.cos(angle) * (in_wrist - along) - torch.sin(angle) * torch.linalg.cross(about, in_wrist)
    length = torch.linalg.vector_norm(in_part, dim=-1, keepdim=True)
    up = in_part.new_tensor((0.0, 0.0, 1.0)).expand_as(in_part)
    return torch.where(length > 0.5, in_part / length.clamp_min(1e-9), up)


def _reflect(vectors: torch.Tensor, normal: torch.Tensor) -> torch.Tensor:
    """Mirror images in the plane with this unit normal."""
    return vectors - 2.0 * (vectors * normal).sum(-1, keepdim=True) * normal


def _mirror_part_turn(turn: torch.Tensor, axis: torch.Tensor) -> torch.Tensor:
    """Rotation vector of ``X R H``: R is that of ``turn``, X mirrors in x = 0, H in the plane with the normal ``axis``.

    ``X R H = (X R X)(X H)``; the first factor has the mirrored turn, the second is a rotation.
    """
    half = 0.5 * torch.linalg.vector_norm(turn, dim=-1, keepdim=True)
    vector = 0.5 * torch.sinc(half / torch.pi) * turn * turn.new_tensor(_TURN)
    scalar = torch.cos(half)
    x = axis.new_tensor((1.0, 0.0, 0.0)).expand_as(axis)
    second_vector, second_scalar = torch.linalg.cross(x, axis), -(x * axis).sum(-1, keepdim=True)
    product = scalar * second_vector + second_scalar * vector + torch.linalg.cross(vector, second_vector)
    product_scalar = scalar * second_scalar - (vector * second_vector).sum(-1, keepdim=True)
    # the shorter of the two turns
    product = torch.where(product_scalar < 0.0, -product, product)
    length = torch.linalg.vector_norm(product, dim=-1, keepdim=True)
    angle = 2.0 * torch.atan2(length, product_scalar.abs())
    return torch.where(length > 1e-6, angle / length.clamp_min(1e-9), 2.0) * product


def _part_vectors() -> list[tuple[slice, float]]:
    """Columns of vectors in the part's frame, and -1 where they are turns."""
    velocity, error = feature_slice("wrist_velocity_in_part").start, feature_slice("pose_error").start
    return [
        (slice(velocity, velocity + 3), 1.0),
        (slice(velocity + 3, velocity + 6), -1.0),
        (slice(error, error + 3), -1.0),
        (feature_slice("keypoint_error_in_part"), 1.0),
    ]


@functools.cache
def _feature_signs() -> torch.Tensor:
    """Sign of every feature in a frame of the hand; of the others it does not matter."""
    signs = torch.ones(FEATURE_COUNT)
    fingers = torch.tensor(_TURN).repeat(FINGER_DOF_COUNT // 3)
    for name in ("finger_angles", "finger_velocities"):
        signs[feature_slice(name)] = fingers
    signs[feature_slice("pose_error")][3:] = fingers
    velocity = feature_slice("part_velocity_in_wrist").start
    signs[velocity : velocity + 6] = torch.tensor((*_SHIFT, *_TURN))
    position, hinge = feature_slice("part_pose_in_wrist").start, feature_slice("hinge_in_wrist").start
    signs[position : position + 3] = torch.tensor(_SHIFT)
    signs[hinge : hinge + 6] = torch.tensor((*_TURN, *_SHIFT))
    return signs


@functools.cache
def _action_signs(config: ActionConfig) -> torch.Tensor:
    """Sign of every action in a frame of the hand; synergies of the fingers are defined for each hand as its own."""
    signs = [torch.ones(len(synergy_directions(config.synergy)))]
    if config.residual is not None:
        signs.append(torch.tensor((*_SHIFT, *(_TURN * ((DOF_COUNT - 3) // 3)))))
    return torch.cat(signs)
