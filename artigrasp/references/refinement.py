"""Refinement of noisy references: fingers out of the object and onto it, everything else as it was.

A pose is changed by gradient descent on a sum of terms, for all references of an object at once. The object is at its
initial hinge angle, the one at which simulated hands meet it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import ObjectModel
from artigrasp.config import RefinementConfig, to_dict
from artigrasp.kernels.layout import ARTICULATED, FINGER_DOF_COUNT, WRIST_DOF_COUNT
from artigrasp.references.descent import descend
from artigrasp.references.energy import FingerTerms, depth_error, differentiate, gap_error, to_tensor
from artigrasp.references.hand_distance import HandDistance, pose_parts_in_base
from artigrasp.references.natural_pose import NaturalPose
from artigrasp.references.poses import compose_poses, invert_poses, wrist_moves
from artigrasp.references.quality import articulates, pose_references, wrist_in_base
from artigrasp.references.reference import ReferenceSet, describe_provenance, join_references

DISTURBANCE = 10.0
"""Standard deviation of disturbed starts, in first steps of the descent: 1 cm and 0.1 rad."""
SOURCE = ", refined"
"""What is added to the source of a refined reference; the file's provenance has the settings."""
REFINED = "-refined"
"""What the splits of refined references are called after the split that they came from."""


@dataclass(frozen=True, eq=False)
class Refinement:
    """What became of R references.

    Attributes:
        references: The refined ones, in the same order.
        start_energy: What the optimiser made small, before, shape (R,).
        end_energy: The same afterwards, never larger, shape (R,).
        moved: How far the wrists of active hands moved, the farthest one of each reference [m], shape (R,).
        turned: How far they turned, likewise [rad], shape (R,).
        bent: Root mean square change of the finger angles of active hands [rad], shape (R,).
    """

    references: ReferenceSet
    start_energy: Array
    end_energy: Array
    moved: Array
    turned: Array
    bent: Array


def refine_references(
    references: ReferenceSet,
    model: ObjectModel,
    hands: tuple[HandModel, HandModel],
    natural: NaturalPose,
    config: RefinementConfig | None = None,
    *,
    device: str = "cpu",
    on_iteration: Callable[[int], None] = lambda iteration: None,
) -> Refinement:
    """Refine the active hands of all references of an object; the same input gives the same result.

    Args:
        references: The references.
        model: Their object.
        hands: Left and right hand.
        natural: Which finger angles are natural.
        config: Weights and scales; the defaults of the class by default.
        device: Warp device.
        on_iteration: Called with the iterations done, for progress.
    """
    config = config or RefinementConfig()
    count = len(references)
    tried = references.select(indices=np.tile(np.arange(count), config.starts))
    posed = pose_references(tried, model, hands, device, requires_grad=True)
    energy = Energy(tried, hands, natural, config, posed)
    joint_q = wp.to_torch(posed.hands.joint_q, requires_grad=False)
    start = joint_q[:count].clone()
    disturbances = DISTURBANCE * torch.randn(joint_q.shape, generator=torch.Generator().manual_seed(config.seed))
    disturbances[:count] = 0.0
    best, least, first = descend(
        joint_q,
        energy.evaluate,
        config.iterations,
        active=torch.as_tensor(tried.active, device=joint_q.device),
        disturbance=disturbances.to(joint_q.device),
        on_iteration=on_iteration,
    )
    least, winner = least.reshape(config.starts, count).min(dim=0)
    best = best[winner * count + torch.arange(count, device=winner.device)]
    return _result(references, model, start, best, first[:count], least)


class Energy:
    """The sum of terms of every reference, as a function of the joint coordinates that ``posed`` has.

    Args:
        references: R references.
        hands: Left and right hand.
        natural: Which finger angles are natural.
        config: Weights and scales.
        posed: The references around their object, as of :func:`artigrasp.references.quality.pose_references`.
    """

    def __init__(
        self,
        references: ReferenceSet,
        hands: tuple[HandModel, HandModel],
        natural: NaturalPose,
        config: RefinementConfig,
        posed: HandDistance,
    ) -> None:
        self._config, self._posed = config, posed
        self._start = wp.to_torch(posed.hands.joint_q, requires_grad=False).clone()
        device = self._start.device
        self._wanted = to_tensor(references.contacts & references.active[:, :, None], device)
        self._articulates = to_tensor(articulates(references), device)[:, :, None]
        self._active = to_tensor(references.active, device)[:, :, None]
        self._fingers = FingerTerms(hands, natural, device)

    def evaluate(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The energy of every reference [R], and its gradient by the joint coordinates [R, 2, 51]."""
        return differentiate(
            self._posed, lambda posed: self._of_contacts(posed.distance) + self._of_pose(posed.joint_q)
        )

    def _of_contacts(self, distance: torch.Tensor) -> torch.Tensor:
        """Of the signed distances of the hands' surface from the parts [R, 2, P, 2]."""
        config = self._config
        depth = depth_error(distance, config.penetration_allowed, config.penetration_scale)
        of_link = distance.gather(2, wp.to_torch(self._posed.nearest).long())
        to_target = torch.where(self._articulates, of_link[..., ARTICULATED], of_link.amin(dim=3))
        contact = gap_error(to_target, config.contact_scale) * self._wanted
        return config.penetration * depth.sum(dim=(1, 2, 3)) + config.contact * contact.sum(dim=(1, 2))

    def _of_pose(self, joint_q: torch.Tensor) -> torch.Tensor:
        """Of the joint coordinates [R, 2, 51], of which the first six are the change of the wrist."""
        config = self._config
        fingers = joint_q[..., WRIST_DOF_COUNT:]
        change = joint_q - self._start
        stay = (change[..., :3] / config.stay_position).square().sum(dim=2)
        stay = stay + (change[..., 3:WRIST_DOF_COUNT] / config.stay_rotation).square().sum(dim=2)
        stay = stay + (change[..., WRIST_DOF_COUNT:] / config.stay_fingers).square().sum(dim=2)
        terms = (
            config.limits * self._fingers.beyond_limits(fingers) / config.limits_scale**2
            + config.natural * self._fingers.unnatural(fingers)
            + config.stay * stay
        )
        total: torch.Tensor = (terms * self._active[..., 0]).sum(dim=1)
        return total


def _result(
    references: ReferenceSet,
    model: ObjectModel,
    start: torch.Tensor,
    end: torch.Tensor,
    start_energy: torch.Tensor,
    end_energy: torch.Tensor,
) -> Refinement:
    before, after = (values.cpu().numpy().astype(np.float64) for values in (start, end))
    active = references.active
    offset = wrist_moves(after)
    turn = Rotation.from_quat(offset[..., 3:].reshape(-1, 4))
    parts = pose_parts_in_base(model, references.object_angle)
    part_of_hand = np.take_along_axis(parts, references.part[:, :, None], axis=1)
    wrist = compose_poses(invert_poses(part_of_hand), compose_poses(wrist_in_base(references, parts), offset))
    refined = replace(
        references,
        # Hands that take no part keep their very numbers.
        wrist_pose_in_part=np.where(active[..., None], wrist, references.wrist_pose_in_part),
        finger_angles=np.where(active[..., None], after[..., WRIST_DOF_COUNT:], references.finger_angles),
        split=np.array([f"{split}{REFINED}" for split in references.split]),
        source=np.array([f"{source}{SOURCE}" for source in references.source]),
    )
    bent = (after - before)[..., WRIST_DOF_COUNT:] ** 2 * active[..., None]
    return Refinement(
        references=refined,
        start_energy=start_energy.cpu().numpy().astype(np.float64),
        end_energy=end_energy.cpu().numpy().astype(np.float64),
        moved=(np.linalg.norm(after[..., :3], axis=-1) * active).max(axis=1),
        turned=(turn.magnitude().reshape(active.shape) * active).max(axis=1),
        bent=np.sqrt(bent.sum(axis=(1, 2)) / (FINGER_DOF_COUNT * active.sum(axis=1))),
    )


def with_refined(references: ReferenceSet, refined: ReferenceSet, config: RefinementConfig) -> ReferenceSet:
    """A set with refined references in place of those that their splits held before, and how they were made."""
    kept = np.flatnonzero(~np.isin(references.split, refined.split))
    made = {"splits": sorted(set(refined.split.tolist())), "settings": to_dict(config), "of": references.provenance}
    provenance = describe_provenance("refine-references", **made)
    return replace(join_references([references.select(indices=kept), refined]), provenance=provenance)


def is_refined(split: str) -> bool:
    """Whether a split holds refined references."""
    return str(split).endswith(REFINED)
