"""How well the hands of references touch their object: how deep they are in it, and which contacts they miss."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_table import put_hands
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import ARTICULATED, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import HandDistance, PartMeshes, pose_parts_in_base
from artigrasp.references.poses import compose_poses
from artigrasp.references.reference import ReferenceSet

CONTACT_DISTANCE = 0.005
"""A link that is no farther than this from a surface touches it [m]."""
IDLE_POSITION = 10.0
"""Where hands without a part in it are put, out of reach of everything [m]."""


@dataclass(frozen=True, eq=False)
class ContactQuality:
    """Contacts of R references, over their active hands, with the object at its initial hinge angle.

    Attributes:
        deepest: How deep the deepest point of the hands' surface is in a part [m], shape (R,).
        mean_depth: Depth of the deepest point of each link, averaged over all links of the active hands [m], (R,).
        deepest_in_own_part: As ``deepest``, but only in the part that each hand's pose is relative to [m], shape (R,).
        target_contacts: Links that should touch, shape (R,).
        missing_contacts: Those of them that are farther than ``CONTACT_DISTANCE`` from where they should touch, (R,).
        beyond_limits: By how much the finger angles exceed the hand's joint limits, root mean square [rad], shape (R,).
    """

    deepest: Array
    mean_depth: Array
    deepest_in_own_part: Array
    target_contacts: NDArray[np.int64]
    missing_contacts: NDArray[np.int64]
    beyond_limits: Array


def measure_contacts(
    references: ReferenceSet, model: ObjectModel, hands: tuple[HandModel, HandModel], device: str = "cpu"
) -> ContactQuality:
    """Measure the references of an object.

    Args:
        references: The references.
        model: Their object.
        hands: Left and right hand.
        device: Warp device.
    """
    posed = pose_references(references, model, hands, device)
    posed.launch()
    distance = posed.link_distance.numpy().astype(np.float64)
    active = references.active[:, :, None]
    depth = np.where(active[..., None], np.maximum(-distance, 0), 0)
    own = np.take_along_axis(depth, references.part[:, :, None, None], axis=3)
    to_target = np.where(articulates(references)[:, :, None], distance[..., ARTICULATED], distance.min(axis=3))
    wanted = references.contacts & active
    lower, upper = (
        np.stack([getattr(hand, name) for hand in hands])[:, WRIST_DOF_COUNT:] for name in ("lower", "upper")
    )
    excess = references.finger_angles - np.clip(references.finger_angles, lower, upper)
    return ContactQuality(
        deepest=depth.max(axis=(1, 2, 3)),
        mean_depth=depth.max(axis=3).sum(axis=(1, 2)) / (active * np.ones(distance.shape[2])).sum(axis=(1, 2)),
        deepest_in_own_part=own.max(axis=(1, 2, 3)),
        target_contacts=wanted.sum(axis=(1, 2)),
        missing_contacts=(wanted & (to_target > CONTACT_DISTANCE)).sum(axis=(1, 2)),
        beyond_limits=np.sqrt((excess**2 * active).sum(axis=(1, 2)) / (active * np.ones_like(excess)).sum(axis=(1, 2))),
    )


def articulates(references: ReferenceSet) -> NDArray[np.bool_]:
    """Which hands should touch the articulated part and nothing else, shape [R, 2]."""
    return np.asarray(references.part == ARTICULATED)


def pose_references(
    references: ReferenceSet,
    model: ObjectModel,
    hands: tuple[HandModel, HandModel],
    device: str,
    *,
    requires_grad: bool = False,
) -> HandDistance:
    """The hands of references around their object in the base's frame, ready to launch.

    The base frame of a hand is its wrist in the reference, so that its first six joint coordinates are zero. Hands that
    take no part are out of reach.
    """
    meshes = PartMeshes([model], device)
    posed = HandDistance(hands, meshes, np.zeros(len(references), int), requires_grad=requires_grad)
    parts = pose_parts_in_base(model, references.object_angle)
    posed.part_pose.assign(parts)
    wrist = wrist_in_base(references, parts)
    wrist[~references.active, :3] = IDLE_POSITION
    put_hands(posed.hands, wrist, references.finger_angles)
    return posed


def wrist_in_base(references: ReferenceSet, parts: NDArray[np.floating]) -> Array:
    """Wrist frames in the base's frame, from the frames of the parts in it [R, 2, 7]; shape [R, 2, 7]."""
    part_of_hand = np.take_along_axis(parts, references.part[:, :, None], axis=1)
    return compose_poses(part_of_hand, references.wrist_pose_in_part)
