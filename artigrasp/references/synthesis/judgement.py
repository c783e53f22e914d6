"""What fitted grips are worth before the physics is asked."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.kernels.layout import ARTICULATED, HANDS, TIP_LINKS
from artigrasp.references.energy import PosedHands, differentiate
from artigrasp.references.hand_distance import pose_parts_in_base
from artigrasp.references.quality import CONTACT_DISTANCE, pose_references
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.synthesis.energy import SynthesisEnergy
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.wrench import holding_error, opening_torque

DEEPEST = 0.003
"""No link of a sound grip is deeper in the object [m]."""
MOST = {"anchor": 20.0, "contact": 4.0, "table": 2.0, "overlap": 2.0, "limits": 2.0, "natural": 12.0, "pads": 6.0}
"""Largest terms of a sound grip, for each hand that takes part."""
LEAST_TIPS = 2
"""Fingertips of each hand that touch, at least."""
MOST_HOLDING_ERROR, LEAST_OPENING_TORQUE = 0.15, 0.4
"""See :mod:`artigrasp.references.synthesis.wrench`."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """Of N grips.

    Attributes:
        energy: What the optimiser made small, shape (N,).
        terms: What it is the sum of, by name, each of shape (N,).
        deepest: How deep the deepest point of the hands is in the object [m], shape (N,).
        merit: Opening torque of an articulation, holding error of a grasp, shape (N,).
        sound: Which are worth trying, shape (N,).
    """

    energy: Array
    terms: dict[str, Array]
    deepest: Array
    merit: Array
    sound: NDArray[np.bool_]


def judge(
    grip: Grip,
    references: ReferenceSet,
    resting: RestingObject,
    hands: tuple[HandModel, HandModel],
    energy: SynthesisEnergy,
    device: str,
) -> tuple[ReferenceSet, Judgement]:
    """Measure fitted grips.

    Args:
        grip: What the hands are to do.
        references: The grips.
        resting: The object.
        hands: Left and right hand.
        energy: What was made small, at the joint coordinates of the grips.
        device: Warp device.

    Returns:
        The grips with the links that touch as target contacts, and what they are worth.
    """
    terms = _terms(energy)
    posed = pose_references(references, resting.model, hands, device)
    posed.launch()
    gaps = posed.link_distance.numpy().astype(np.float64)
    position, normal = _contact_points(posed.nearest.numpy(), posed.closest.numpy(), posed.normal.numpy())
    position, normal = _in_base(position, normal, resting.model, resting.angle)
    active = references.active[:, :, None]
    deepest = np.where(active[..., None], np.maximum(-gaps, 0), 0).max(axis=(1, 2, 3))
    near = (gaps < CONTACT_DISTANCE) & active[..., None]
    contacts = near[..., ARTICULATED] if grip.kind == "articulate" else near.any(axis=3)
    merit = np.zeros(len(references))
    for row in range(len(references)):
        touching = near[row].copy()
        if grip.kind == "articulate":
            touching[..., 1 - ARTICULATED] = False
        points = (position[row][touching], normal[row][touching], resting)
        merit[row] = opening_torque(*points) if grip.kind == "articulate" else holding_error(*points)
    tips = contacts[:, :, list(TIP_LINKS)].sum(axis=2)
    taking = [HANDS.index(side) for side in grip.sides]
    sound = (deepest < DEEPEST) & (tips[:, taking] >= LEAST_TIPS).all(axis=1)
    sound &= merit >= LEAST_OPENING_TORQUE if grip.kind == "articulate" else merit <= MOST_HOLDING_ERROR
    for name, most in MOST.items():
        sound &= terms[name] <= most * len(taking)
    total = np.sum(list(terms.values()), axis=0)
    return replace(references, contacts=contacts), Judgement(total, terms, deepest, merit, sound)


def _terms(energy: SynthesisEnergy) -> dict[str, Array]:
    found: dict[str, torch.Tensor] = {}

    def keep(posed: PosedHands) -> torch.Tensor:
        found.update(energy.terms(posed))
        return torch.stack(list(found.values())).sum(dim=0)

    differentiate(energy.posed, keep)
    return {name: term.detach().cpu().numpy().astype(np.float64) for name, term in found.items()}


def _contact_points(nearest: NDArray[np.int32], closest: Array, normal: Array) -> tuple[Array, Array]:
    """Where each link is nearest to each part, and the normal there, in the part's frame, [N, 2, 16, 2, 3]."""
    index = nearest.astype(np.int64)[..., None]
    return np.take_along_axis(closest, index, axis=2), np.take_along_axis(normal, index, axis=2)


def _in_base(position: Array, normal: Array, model: ObjectModel, angle: float) -> tuple[Array, Array]:
    """Points and vectors in the parts' frames, [..., 2, 3], in the base's."""
    placed, turned = [], []
    for part, pose in enumerate(pose_parts_in_base(model, np.array([angle]))[0]):
        turn = Rotation.from_quat(pose[3:])
        shape = (*position.shape[:-2], 3)
        placed.append(turn.apply(position[..., part, :].reshape(-1, 3)).reshape(shape) + pose[:3])
        turned.append(turn.apply(normal[..., part, :].reshape(-1, 3)).reshape(shape))
    return np.stack(placed, axis=-2), np.stack(turned, axis=-2)
