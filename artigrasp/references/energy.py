"""What poses of hands around an object cost: the terms that refinement and synthesis share, and their gradient.

Warp measures how far the hands' surface is from the object and takes gradients back through that and forward
kinematics; PyTorch has the terms. All of them are sums of squares of errors over scales.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel
from artigrasp.assets.hand_model import MIRROR_FINGERS
from artigrasp.kernels.layout import FINGER_DOF_COUNT, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import HandDistance
from artigrasp.references.natural_pose import NaturalPose


@dataclass(frozen=True, eq=False)
class PosedHands:
    """Hands of R configurations, as tensors that an energy can be differentiated by.

    Attributes:
        joint_q: Joint coordinates [m, rad], shape [R, H, 51].
        link_pose: Link frames in the object's: position [m], quaternion xyzw, shape [R, H, 16, 7].
        position: Centres of the balls that the hands are made of [m], shape [R, H, P, 3].
        distance: Their signed distances from the parts [m], shape [R, H, P, 2].
    """

    joint_q: torch.Tensor
    link_pose: torch.Tensor
    position: torch.Tensor
    distance: torch.Tensor


def differentiate(
    posed: HandDistance, energy: Callable[[PosedHands], torch.Tensor]
) -> tuple[torch.Tensor, torch.Tensor]:
    """An energy of every configuration [R], and its gradient by the joint coordinates [R, H, 51].

    Args:
        posed: The hands, at the joint coordinates that it has, made with ``requires_grad``.
        energy: From the posed hands, shape [R]; that of each configuration from it alone.
    """
    with wp.Tape() as tape:
        posed.launch()
    arrays = (posed.hands.joint_q, posed.hands.link_pose, posed.position, posed.distance)
    leaves = [wp.to_torch(array, requires_grad=False).clone().requires_grad_() for array in arrays]
    value = energy(PosedHands(*leaves))
    gradients = torch.autograd.grad(value.sum(), leaves, allow_unused=True)
    tape.backward(
        grads={
            array: wp.from_torch(gradient.contiguous(), dtype=array.dtype)
            for array, gradient in zip(arrays[1:], gradients[1:], strict=True)
            if gradient is not None
        }
    )
    gradient = wp.to_torch(posed.hands.joint_q.grad).clone()
    if gradients[0] is not None:
        gradient += gradients[0]
    tape.zero()
    return value.detach(), gradient


def depth_error(distance: torch.Tensor, allowed: float, scale: float | torch.Tensor) -> torch.Tensor:
    """Squared depths beyond what counts as touching, over their scale, from signed distances; same shape."""
    return (torch.relu(-distance - allowed) / scale) ** 2


def gap_error(distance: torch.Tensor, scale: float) -> torch.Tensor:
    """Distances from a surface over their scale, squared up to one and linear beyond, zero inside; same shape."""
    error = torch.relu(distance) / scale
    return torch.where(error < 1, error**2, 2 * error - 1)


class FingerTerms:
    """Terms of the finger angles of hands.

    Args:
        hands: The H hands.
        natural: Which finger angles are natural.
        device: PyTorch device.
    """

    def __init__(self, hands: Sequence[HandModel], natural: NaturalPose, device: torch.device) -> None:
        self._lower, self._upper = (
            to_tensor(np.stack([getattr(hand, name) for hand in hands])[:, WRIST_DOF_COUNT:], device)
            for name in ("lower", "upper")
        )
        to_right = np.stack([MIRROR_FINGERS if hand.side == "left" else np.ones(FINGER_DOF_COUNT) for hand in hands])
        self._to_right = to_tensor(to_right, device)
        self._mean, self._whitening = to_tensor(natural.mean, device), to_tensor(natural.whitening, device)

    def beyond_limits(self, fingers: torch.Tensor) -> torch.Tensor:
        """Sum of squares of what finger angles [R, H, 45] exceed the joint limits by [rad²], shape [R, H]."""
        excess = torch.relu(fingers - self._upper) + torch.relu(self._lower - fingers)
        return excess.square().sum(dim=2)

    def unnatural(self, fingers: torch.Tensor) -> torch.Tensor:
        """Squared distance of finger angles [R, H, 45] from natural ones, in standard deviations, shape [R, H]."""
        deviations = (fingers * self._to_right - self._mean) @ self._whitening.T
        return deviations.square().sum(dim=2)


def to_tensor(values: NDArray[np.generic], device: torch.device) -> torch.Tensor:
    """An array on a device, its numbers in single precision."""
    kind = torch.float32 if values.dtype.kind == "f" else None
    return torch.as_tensor(np.ascontiguousarray(values), dtype=kind, device=device)
