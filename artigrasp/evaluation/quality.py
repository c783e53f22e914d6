"""How well a motion is made, besides reaching its target: measured while a controller plays, alike in every experiment.

None of this is in the paper. Penetration is of the hands' collision shapes into the objects' visible surfaces, which
the simulator replaces by convex pieces and lets give way a little.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.object import ObjectModel
from artigrasp.environment.environment import Environment
from artigrasp.kernels import quality
from artigrasp.kernels.layout import ARTICULATED, BASE, KEYPOINT_COUNT, PARTS
from artigrasp.kernels.parts import pose_parts
from artigrasp.references.hand_distance import HandDistance, PartMeshes

DEPTH_INTERVAL = 10
"""Control steps between two measurements of the penetration."""

ADD_LIMIT = 0.1
"""Average distance [m] at which nothing is left of a trial's ADD-AUC; that of a trial whose physics failed."""

_REACH = 0.05
"""How far to look for a surface [m]; deeper penetration counts as none, but is beyond belief."""


class QualityRecorder:
    """Measures the episodes of all worlds of an environment as they pass."""

    def __init__(self, environment: Environment) -> None:
        """Measure ``environment`` from its next reset on."""
        self._environment = environment
        worlds, hands, device = environment.world_count, environment.hand_count, environment.device
        self._quality = quality.motion_quality(worlds, hands, KEYPOINT_COUNT, device)
        self._distance = HandDistance(
            environment.hands, PartMeshes(environment.objects, device), environment.worlds.object_index, reach=_REACH
        )

    def record(self, step: int) -> None:
        """Take in the state after a control step, first that of the reset, which is step 0."""
        environment, distance = self._environment, self._distance
        hands, goal, failure = environment.state.hands, environment.goal, environment.metrics.failure
        each_hand = (environment.world_count, environment.hand_count)
        wp.launch(
            quality.update_quality, each_hand, [hands, goal, failure, step, self._quality], device=environment.device
        )
        if step % DEPTH_INTERVAL == 0:
            wp.copy(distance.hands.joint_q, hands.joint_q)
            wp.copy(distance.hands.hand_base, hands.hand_base)
            parts = [environment.state.objects, environment.object_model, distance.part_pose]
            wp.launch(pose_parts, (environment.world_count, len(PARTS)), parts, device=environment.device)
            distance.launch()
            wp.launch(
                quality.add_depth,
                environment.world_count,
                [goal, failure, distance.link_distance, self._quality],
                device=environment.device,
            )

    def columns(self) -> dict[str, Any]:
        """The columns of `Outcomes` that tell the quality, each of shape [world]."""
        environment, sums = self._environment, self._quality
        hands = np.maximum(environment.goal.active.numpy().sum(axis=1), 1)
        steps = np.maximum(environment.metrics.step_count.numpy() - 2, 1)
        contact_steps = sums.contact_steps.numpy().sum(axis=1)
        distances = average_distances(environment)
        return {
            "base_distance": distances[:, BASE],
            "articulated_distance": distances[:, ARTICULATED],
            "penetration": sums.depth_sum.numpy() / np.maximum(sums.depth_count.numpy(), 1),
            "jerk": sums.jerk_sum.numpy().sum(axis=1) / hands / steps / environment.task.control_dt**3,
            "contact_consistency": sums.steadiness_sum.numpy().sum(axis=1) / np.maximum(contact_steps, 1),
        }


def average_distances(environment: Environment) -> Array:
    """Mean distance of the vertices of each part from where the target has them (ADD) [m], shape [world, part].

    It is ``ADD_LIMIT`` where the physics failed.
    """
    goal, objects = environment.goal, environment.state.objects
    reached, wanted = (
        np.column_stack([pose.numpy(), angle.numpy()])
        for pose, angle in ((objects.pose, objects.hinge_q), (goal.target_object_pose, goal.target_angle))
    )
    measurable = (environment.metrics.failure.numpy() == 0) & np.isfinite(reached).all(axis=1)
    distances = np.full((environment.world_count, len(PARTS)), ADD_LIMIT)
    for world in np.flatnonzero(measurable):
        model = environment.objects[environment.worlds.object_index[world]]
        places = [_part_vertices(model, *np.split(each[world], [3, 7])) for each in (reached, wanted)]
        for part, (found, expected) in enumerate(zip(*places, strict=True)):
            distances[world, part] = np.linalg.norm(found - expected, axis=1).mean()
    return distances


def _part_vertices(
    model: ObjectModel, position: NDArray[np.float32], rotation: NDArray[np.float32], angle: NDArray[np.float32]
) -> tuple[Array, ...]:
    """Vertices of both parts in the world [m], with the base at a pose and the hinge at an angle [rad]."""
    split = len(model.parts[BASE].vertices)
    vertices = Rotation.from_quat(rotation).apply(model.vertices_in_base(float(angle[0]))) + position
    return vertices[:split], vertices[split:]


def area_under_curve(distance: Array) -> Array:
    """ADD-AUC of single trials: the share of the thresholds from 0 to ``ADD_LIMIT`` that a distance lies below."""
    return np.asarray(np.clip(1.0 - distance / ADD_LIMIT, 0.0, 1.0))
