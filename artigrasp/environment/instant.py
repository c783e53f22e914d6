"""A scene in the middle of what happens in it, from which episodes may begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.environment.bystanders import Bystanders
from artigrasp.kernels import resumes, states

if TYPE_CHECKING:
    from artigrasp.environment.environment import Environment

_HAND_FIELDS = tuple(states.element_types(resumes.HandInstant))
_OBJECT_FIELDS = tuple(states.element_types(states.ObjectSlots))


@dataclass(frozen=True, eq=False)
class Instant:
    """H hands and O objects of one world at one instant; frames: world."""

    joint_q: NDArray[np.float32]
    """Joint coordinates of the hands [m | rad], shape [H, 51]."""
    joint_qd: NDArray[np.float32]
    """Their rates [m/s | rad/s], shape [H, 51]."""
    hand_base: NDArray[np.float32]
    """Frame that the wrist coordinates are relative to: position [m], quaternion xyzw, shape [H, 7]."""
    target: NDArray[np.float32]
    """PD targets [m | rad], shape [H, 51]."""
    stiffness: NDArray[np.float32]
    """PD stiffness of the ``DOF_GROUPS`` [N/m | N·m/rad], shape [H, 3]."""
    damping: NDArray[np.float32]
    """PD damping [N·s/m | N·m·s/rad], shape [H, 3]."""
    pose: NDArray[np.float32]
    """Frames of the objects' bases: position [m], quaternion xyzw, shape [O, 7]."""
    velocity: NDArray[np.float32]
    """Their velocities: linear [m/s], angular [rad/s], shape [O, 6]."""
    hinge_q: NDArray[np.float32]
    """Hinge angles [rad], shape [O]."""
    hinge_qd: NDArray[np.float32]
    """Their rates [rad/s], shape [O]."""

    def in_order(self, slots: Sequence[int]) -> Instant:
        """The same with its objects in another order: first the one that was in the first of these slots, and so on."""
        return replace(self, **{name: getattr(self, name)[list(slots)] for name in _OBJECT_FIELDS})


def read_instant(environment: Environment, world: int) -> Instant:
    """Where one world of an environment is now."""
    state = environment.state
    holders: dict[str, Any] = dict.fromkeys(("joint_q", "joint_qd", "hand_base"), state.hands)
    holders |= dict.fromkeys(("target", "stiffness", "damping"), environment)
    holders |= dict.fromkeys(_OBJECT_FIELDS, state.slots)
    return Instant(**{name: np.array(getattr(holder, name).numpy()[world]) for name, holder in holders.items()})


class Beginning:
    """Lets the episodes of an environment begin at an instant."""

    def __init__(
        self, instant: Instant, keeps: NDArray[np.bool_], target_object_pose: ArrayLike, environment: Environment
    ) -> None:
        """Copy the instant to the device.

        Args:
            instant: With the object of the world's references first, then the bystanders.
            keeps: Hands that keep their targets and gains, shape [world, hand].
            target_object_pose: Where the first object should go, shape [7] or [world, 7].
            environment: Whose worlds begin.

        Raises:
            ValueError: It is of other hands or another number of objects.
        """
        expected = (environment.hand_count, environment.state.object_count)
        if (len(instant.joint_q), len(instant.pose)) != expected:
            found = f"{len(instant.joint_q)} and {len(instant.pose)}"
            raise ValueError(f"instant: expected {expected[0]} hands and {expected[1]} objects, found {found}")
        self.instant, device, count = instant, environment.device, environment.world_count
        self.keeps = np.broadcast_to(keeps, (count, environment.hand_count))
        self.target_object_pose = np.broadcast_to(np.asarray(target_object_pose, np.float32), (count, 7))
        self._environment = environment
        self._hands = resumes.HandInstant()
        for name in _HAND_FIELDS:
            dtype = wp.transform if name == "hand_base" else float
            rows = np.ascontiguousarray(getattr(instant, name), dtype=np.float32)
            setattr(self._hands, name, wp.array(rows, dtype=dtype, device=device))
        self._target_pose = wp.array(np.ascontiguousarray(self.target_object_pose), dtype=wp.transform, device=device)
        environment.goal.keeps.assign(self.keeps.astype(np.int32))

    def place_objects(self, bystanders: Bystanders) -> None:
        """Let resets put all objects where they are at the instant."""
        bystanders.place_all({name: getattr(self.instant, name) for name in _OBJECT_FIELDS})

    def resume(self, world_mask: wp.array, goal_angle: wp.array) -> None:
        """Begin the episodes that were just reset, the objects being where they should be.

        Args:
            world_mask: Where, int, [world].
            goal_angle: Target of the hinge angle [rad], negative to keep it as it is, [world].
        """
        environment = self._environment
        outputs = [environment.state.hands, environment.goal, environment.phase, environment.target]
        wp.launch(
            resumes.resume_worlds,
            (environment.world_count, environment.hand_count),
            inputs=[world_mask, self._hands, environment.state.objects, goal_angle, self._target_pose],
            outputs=[*outputs, environment.stiffness, environment.damping],
            device=environment.device,
        )
