"""Episodes that begin in the middle of what happens in a scene."""

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from artigrasp.environment.acting import Acting
from artigrasp.environment.bystanders import Bystanders
from artigrasp.environment.instant import HAND_FIELDS, OBJECT_FIELDS, Instant
from artigrasp.kernels import resumes, states
from artigrasp.simulation.state import SimulationState


class Beginning:
    """Lets the episodes of an environment begin at an instant.

    Attributes:
        instant: Where hands and objects are then.
        keeps: Hands that keep their targets and gains, shape [world, hand].
        target_object_pose: Where the first object should go, shape [world, 7].
    """

    def __init__(
        self,
        instant: Instant,
        keeps: NDArray[np.bool_],
        target_object_pose: ArrayLike,
        *,
        physics: SimulationState,
        goal: states.Goal,
        phase: states.PhaseState,
        acting: Acting,
    ) -> None:
        """Copy the instant to the device.

        Args:
            instant: With the object of the world's references first, then the bystanders.
            keeps: Hands that keep their targets and gains, shape [world, hand].
            target_object_pose: Where the first object should go, shape [7] or [world, 7].
            physics: Where hands and objects are.
            goal: What is asked of them.
            phase: Where worlds are in their phases.
            acting: What hands are told.

        Raises:
            ValueError: It is of other hands or another number of objects.
        """
        self._shape = physics.hands.joint_q.shape[:2]
        expected = (self._shape[1], physics.object_count)
        if (len(instant.joint_q), len(instant.pose)) != expected:
            found = f"{len(instant.joint_q)} and {len(instant.pose)}"
            raise ValueError(f"instant: expected {expected[0]} hands and {expected[1]} objects, found {found}")
        self.instant, device = instant, physics.focus.device
        self.keeps = np.broadcast_to(keeps, self._shape)
        self.target_object_pose = np.broadcast_to(np.asarray(target_object_pose, np.float32), (self._shape[0], 7))
        self._objects = physics.objects
        self._outputs = [physics.hands, goal, phase, acting.target, acting.stiffness, acting.damping]
        self._hands = resumes.HandInstant()
        for name in HAND_FIELDS:
            dtype = wp.transform if name == "hand_base" else float
            rows = np.ascontiguousarray(getattr(instant, name), dtype=np.float32)
            setattr(self._hands, name, wp.array(rows, dtype=dtype, device=device))
        self._target_pose = wp.array(np.ascontiguousarray(self.target_object_pose), dtype=wp.transform, device=device)
        acting.home.assign(np.broadcast_to(instant.home, (*self._shape, 7)))
        goal.keeps.assign(self.keeps.astype(np.int32))

    def place_objects(self, bystanders: Bystanders) -> None:
        """Let resets put all objects where they are at the instant."""
        bystanders.place_all({name: getattr(self.instant, name) for name in OBJECT_FIELDS})

    def resume(self, world_mask: wp.array, goal_angle: wp.array) -> None:
        """Begin the episodes that were just reset, the objects being where they should be.

        Args:
            world_mask: Where, int, [world].
            goal_angle: Target of the hinge angle [rad], negative to keep it as it is, [world].
        """
        wp.launch(
            resumes.resume_worlds,
            self._shape,
            inputs=[world_mask, self._hands, self._objects, goal_angle, self._target_pose],
            outputs=self._outputs,
            device=world_mask.device,
        )
