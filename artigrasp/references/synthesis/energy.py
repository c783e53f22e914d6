"""What a synthesised grip costs."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_surface import HandPoints, core_points
from artigrasp.assets.hand_table import put_hands
from artigrasp.config import SynthesisConfig
from artigrasp.kernels.layout import LINK_PARENTS, TIP_LINKS, WRIST_DOF_COUNT
from artigrasp.references.energy import FingerTerms, PosedHands, depth_error, differentiate, gap_error, to_tensor
from artigrasp.references.hand_distance import HandDistance, PartMeshes, pose_parts_in_base
from artigrasp.references.natural_pose import NaturalPose
from artigrasp.references.synthesis.fingertips import Fingertips
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.intents import THUMB, Intents

SAG, REACH = 1.5e-3, 0.035
"""How far the balls that stand for a hand may lie below its surface, and how far they look for the object's [m]."""
FOREARM = np.linspace(0.05, 0.20, 6)
"""Middles of the balls that stand for a forearm, behind the wrist [m]."""
FOREARM_RADIUS = 0.03
PAD_COSINE, PAD_SCALE = 0.5, 0.3
"""A pad may be turned from the surface by this cosine, and the scale of what it lacks."""
TORQUE_LENGTH = 0.05
"""Distance at which a force's torque counts as much as the force [m]."""
TABLE_SCALE = 0.002
"""Scale of what hands lack in clearance from the table [m]."""
PALM_BALLS = 8
"""Balls of a palm that must not overlap with others."""
OVERLAP_ALLOWED = 0.001
"""Depth of links in each other that counts as touching [m]."""


class SynthesisEnergy:
    """The sum of terms of N grips, as a function of the joint coordinates of ``posed``.

    Attributes:
        posed: The hands around the object in the base's frame, at first where they start.

    Args:
        grip: What the hands do.
        intents: What each of them is meant to touch.
        start: Wrist poses in the base's frame and finger angles, (N, H, 7) and (N, H, 45).
        resting: The object.
        hands: The hands.
        natural: Which finger angles are natural.
        config: Weights and scales.
        meshes: The object's surface.
    """

    def __init__(
        self,
        grip: Grip,
        intents: Intents,
        start: tuple[Array, Array],
        resting: RestingObject,
        hands: Sequence[HandModel],
        natural: NaturalPose,
        config: SynthesisConfig,
        meshes: PartMeshes,
    ) -> None:
        self._grip, self._config = grip, config
        points = [_with_forearm(core_points(hand, SAG), hand.side) for hand in hands]
        count = len(intents)
        self.posed = HandDistance(hands, meshes, np.zeros(count, int), points=points, reach=REACH, requires_grad=True)
        angle = np.full(count, resting.angle)
        self.posed.part_pose.assign(pose_parts_in_base(resting.model, angle))
        put_hands(self.posed.hands, *start)
        device = wp.to_torch(self.posed.hands.joint_q, requires_grad=False).device
        tensor = partial(to_tensor, device=device)
        tips = Fingertips(hands)
        self._tip_centre, self._tip_radius, self._pad = tensor(tips.centre), tensor(tips.radius), tensor(tips.pad)
        self._target, self._normal = tensor(intents.target), tensor(intents.normal)
        self._part, self._busy = tensor(intents.part), tensor(intents.busy.astype(np.float32))
        self._weight = tensor(press_weights(intents.busy))
        self._up, self._floor = tensor(resting.up), resting.floor
        self._com, self._lever = tensor(resting.com), resting.lever
        self._hinge_origin, self._hinge_axis = tensor(resting.model.hinge_origin), tensor(resting.model.hinge_axis)
        self._fingers = FingerTerms(hands, natural, device)
        radius = self.posed.points.radius.numpy()
        behind = np.stack([_padded(_is_forearm(each), radius.shape[1]) for each in points])
        self._radius = tensor(radius)
        self._scale = tensor(np.where(behind, config.forearm_scale, config.penetration_scale))[..., None]
        self._clearance = tensor(np.where(behind, 0.0, config.table_clearance))
        self._table_scale = tensor(np.where(behind, config.forearm_scale, TABLE_SCALE))
        self._pairs = [(first, second, tensor(pairs)) for first, second, pairs in _overlap_pairs(points, hands)]

    def evaluate(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The energy of every grip [N], and its gradient by the joint coordinates [N, H, 51]."""
        return differentiate(self.posed, lambda posed: sum(self.terms(posed).values(), torch.zeros(())))

    def terms(self, posed: PosedHands) -> dict[str, torch.Tensor]:
        """Every term by name, weighted, shape [N]."""
        config = self._config
        frames = posed.link_pose[:, :, list(TIP_LINKS)]
        tip = frames[..., :3] + rotate(frames[..., 3:], self._tip_centre)
        pad = rotate(frames[..., 3:], self._pad)
        gap, normal = self._of_tips(posed)
        fingers = posed.joint_q[..., WRIST_DOF_COUNT:]
        offset = tip - self._target - self._normal * self._tip_radius[..., None]
        facing = PAD_COSINE + (pad * self._normal).sum(dim=-1)
        terms = {
            "anchor": config.anchor * (offset.square().sum(dim=-1) / config.anchor_scale**2 * self._busy).sum((1, 2)),
            "contact": config.contact * (gap_error(gap, config.contact_scale) * self._busy).sum(dim=(1, 2)),
            "pads": config.pads * ((torch.relu(facing) / PAD_SCALE).square() * self._busy).sum(dim=(1, 2)),
            "penetration": config.penetration
            * depth_error(posed.distance, config.penetration_allowed, self._scale).sum(dim=(1, 2, 3)),
            "table": config.table * self._of_table(posed.position),
            "overlap": config.overlap * self._of_overlap(posed.position),
            "limits": config.limits * self._fingers.beyond_limits(fingers).sum(dim=1) / config.limits_scale**2,
            "natural": config.natural * self._fingers.unnatural(fingers).sum(dim=1),
        }
        touch = tip - normal * self._tip_radius[..., None]
        if self._grip.kind == "grasp":
            terms["balance"] = config.balance * self._of_balance(touch, normal)
        else:
            terms["leverage"] = config.leverage * self._of_leverage(touch)
        return terms

    def _of_tips(self, posed: PosedHands) -> tuple[torch.Tensor, torch.Tensor]:
        """Gaps between the fingertips and the parts that they are meant for, and the normals there, [N, H, 5]."""
        part = self._part[..., None]
        nearest = wp.to_torch(self.posed.nearest).long()[:, :, list(TIP_LINKS)].gather(3, part)[..., 0]
        distance = posed.distance.gather(2, nearest[..., None].expand(-1, -1, -1, 2)).gather(3, part)[..., 0]
        index = nearest[..., None, None].expand(-1, -1, -1, 2, 3)
        normal = wp.to_torch(self.posed.normal, requires_grad=False).gather(2, index)
        normal = normal.gather(3, part[..., None].expand(-1, -1, -1, -1, 3))[..., 0, :]
        turn = wp.to_torch(self.posed.part_pose, requires_grad=False)[:, :, 3:]
        turns = turn[:, None, None].expand(-1, *self._part.shape[1:], -1, -1)
        return distance, rotate(turns.gather(3, part[..., None].expand(-1, -1, -1, -1, 4))[..., 0, :], normal)

    def _of_table(self, position: torch.Tensor) -> torch.Tensor:
        height = position @ self._up - self._floor - self._radius
        return (torch.relu(self._clearance - height) / self._table_scale).square().sum(dim=(1, 2))

    def _of_overlap(self, position: torch.Tensor) -> torch.Tensor:
        total = torch.zeros(len(position), device=position.device)
        for first, second, pairs in self._pairs:
            one, other = position[:, first, pairs[:, 0]], position[:, second, pairs[:, 1]]
            reach = self._radius[first, pairs[:, 0]] + self._radius[second, pairs[:, 1]]
            gap = (one - other).square().sum(dim=-1).clamp(min=1e-12).sqrt() - reach
            total = total + depth_error(gap, OVERLAP_ALLOWED, self._config.overlap_scale).sum(dim=1)
        return total

    def _of_balance(self, touch: torch.Tensor, normal: torch.Tensor) -> torch.Tensor:
        """Of the net force and torque of fingertips that press along the normals where they touch [N, H, 5, 3]."""
        force = -normal * self._weight[..., None]
        torque: torch.Tensor = torch.linalg.cross(touch - self._com, force) / TORQUE_LENGTH
        return force.sum(dim=(1, 2)).square().sum(dim=1) + torque.sum(dim=(1, 2)).square().sum(dim=1)

    def _of_leverage(self, touch: torch.Tensor) -> torch.Tensor:
        axis = self._hinge_axis.expand_as(touch)
        arm: torch.Tensor = torch.linalg.cross(axis, touch - self._hinge_origin).norm(dim=-1)
        return (torch.relu(1 - arm / self._lever).square() * self._weight).sum(dim=(1, 2))


def press_weights(busy: NDArray[np.bool_]) -> Array:
    """How much each fingertip presses [N, H, 5]: the long fingers of a hand as much together as its thumb."""
    fingers = busy.copy()
    fingers[..., THUMB] = False
    share = 1.0 / np.maximum(fingers.sum(axis=2, keepdims=True), 1)
    weight = fingers * share
    weight[..., THUMB] = busy[..., THUMB]
    return np.asarray(weight, np.float64)


def rotate(quaternion: torch.Tensor, vector: torch.Tensor) -> torch.Tensor:
    """Vectors [..., 3] turned by quaternions xyzw [..., 4]."""
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    vector = vector.expand_as(axis)
    twice: torch.Tensor = 2.0 * torch.linalg.cross(axis, vector)
    turned: torch.Tensor = vector + w * twice + torch.linalg.cross(axis, twice)
    return turned


def _with_forearm(points: HandPoints, side: str) -> HandPoints:
    """The balls of a hand and, after those of its palm, those of a forearm straight behind it."""
    palm = int((points.link == 0).sum())
    behind = np.zeros((len(FOREARM), 3))
    behind[:, 0] = FOREARM * (-1.0 if side == "left" else 1.0)
    return HandPoints(
        link=np.insert(points.link, palm, np.zeros(len(FOREARM), np.int32)),
        position=np.insert(points.position, palm, behind[::-1], axis=0),
        radius=np.insert(points.radius, palm, np.full(len(FOREARM), FOREARM_RADIUS)),
    )


def _is_forearm(points: HandPoints) -> NDArray[np.bool_]:
    palm = int((points.link == 0).sum())
    return np.asarray((np.arange(len(points.link)) < palm) & (np.arange(len(points.link)) >= palm - len(FOREARM)))


def _padded(values: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """As tables of points have them: the last value is repeated."""
    return values[np.minimum(np.arange(count), len(values) - 1)]


def _overlap_pairs(
    points: Sequence[HandPoints], hands: Sequence[HandModel]
) -> list[tuple[int, int, NDArray[np.int64]]]:
    """Balls that must not overlap: first hand, second hand, and their indices [M, 2]; few balls for each link."""
    few = [_few_balls(each) for each in points]
    result = []
    for hand, (each, rows) in enumerate(zip(points, few, strict=True)):
        place = each.position + hands[hand].link_origin[each.link]
        one, other = (rows[index] for index in np.triu_indices(len(rows), 1))
        gap = np.linalg.norm(place[one] - place[other], axis=1) - each.radius[one] - each.radius[other]
        # Neighbours, and what touches in a flat hand, may overlap.
        apart = (gap > OVERLAP_ALLOWED) & (each.link[one] != each.link[other])
        apart &= ~_related(each.link[one], each.link[other])
        result.append((hand, hand, np.stack([one[apart], other[apart]], axis=1)))
    if len(points) == 2:
        between = np.stack(np.meshgrid(*few, indexing="ij"), axis=-1).reshape(-1, 2)
        result.append((0, 1, between))
    return result


def _few_balls(points: HandPoints) -> NDArray[np.int64]:
    """First and last ball of each link of the fingers, and some of the palm."""
    rows = [np.flatnonzero(points.link == link) for link in range(len(LINK_PARENTS))]
    palm = rows[0][: len(rows[0]) - len(FOREARM)]
    chosen = [palm[np.linspace(0, len(palm) - 1, PALM_BALLS).astype(int)], *(each[[0, -1]] for each in rows[1:])]
    return np.unique(np.concatenate(chosen))


def _related(one: NDArray[np.int32], other: NDArray[np.int32]) -> NDArray[np.bool_]:
    parents = np.array(LINK_PARENTS)
    return np.asarray((parents[one] == other) | (parents[other] == one))
