"""Everything that acts: a controller maps features to actions of its own action space."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict

from artigrasp.config import ActionConfig, TaskConfig
from artigrasp.config.task import MIRRORED, Side
from artigrasp.controllers.mirror import mirror_actions, mirror_features
from artigrasp.controllers.network import OBSERVATION_GROUP, observed_columns
from artigrasp.controllers.policy_file import PolicyFile, make_actors
from artigrasp.environment.action_columns import action_count


class Controller(Protocol):
    """What evaluation and generation drive."""

    @property
    def name(self) -> str:
        """Name in tables and files."""
        ...

    @property
    def task(self) -> TaskConfig:
        """The task with the action space that :meth:`act` answers in."""
        ...

    @property
    def hand(self) -> str | None:
        """Name of the hand model that it was made for, None if for any."""
        ...

    @property
    def rollout_count(self) -> int:
        """Episodes of the trial itself that it may simulate before the one that counts; 0 for all but search."""
        ...

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Decide.

        Args:
            features: [world, hand, 279] features of the present state.

        Returns:
            [world, hand, action] actions.
        """
        ...


@dataclass(frozen=True)
class ZeroController:
    """The action that is all zeros: what the task's prior does by itself."""

    task: TaskConfig
    name: str = "zero"
    hand: None = None
    rollout_count: int = 0

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Zeros."""
        return np.zeros((*features.shape[:2], action_count(self.task.action)), dtype=np.float32)


PD_IK = ActionConfig(
    wrist_prior="hinge",
    finger_prior="reference",
    synergy=None,
    residual=None,
    approach_steps=60,
    close_start=30,
    close_end=70,
)
"""The PD+IK baseline (paper, Baselines): the wrist follows the hinge toward the goal as if it were fixed to the
manipulated part, and the fingers close to the reference; nothing is decided."""


def pd_ik_controller(task: TaskConfig) -> ZeroController:
    """PD+IK in a task's scene."""
    return ZeroController(replace(task, action=PD_IK), name="pd-ik")


D_GRASP = replace(PD_IK, wrist_prior="schedule", lead_start=70, lead_end=270)
"""D-Grasp's wrist control for articulation (paper, Baselines): the angle of the hinge is raised gradually, over two
seconds, and the wrist goes where it would be if it were fixed to the part at that angle, wherever the part is."""


def d_grasp_controller(task: TaskConfig) -> ZeroController:
    """D-Grasp's wrist control in a task's scene, with fingers that close to the reference, as PD+IK's do.

    The paper's D-Grasp row has a learned grasping policy in their place; its PD+IK row is this.
    """
    return ZeroController(replace(task, action=D_GRASP), name="d-grasp")


def acting_network(side: Side, names: Collection[str]) -> tuple[str, bool]:
    """Which of a policy's networks acts for a hand, and whether it sees and acts as the hand's mirror image."""
    (other,) = {"left", "right"} - {side}
    name = next(each for each in (side, MIRRORED, other) if each in names)
    return name, name == other or (name == MIRRORED and side == "left")


class PolicyController:
    """A trained policy, acting by the mean of its distribution."""

    name = "policy"
    rollout_count = 0

    def __init__(self, policy: PolicyFile) -> None:
        """Load the networks' weights."""
        self.task, self.hand = policy.task, policy.hand
        self._columns = observed_columns(policy.task.ppo)
        self._actors = {name: actor.eval() for name, actor in make_actors(policy).items()}

    def act(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """The policy's mean action for every hand of the task's scene.

        A hand for which there is no network is acted for by the other's, as its mirror image.
        """
        seen = torch.from_numpy(features.copy())
        with torch.inference_mode():
            columns = [self._act_for(side, seen[:, hand]) for hand, side in enumerate(self.task.hands)]
        return np.stack([column.numpy() for column in columns], axis=1).astype(np.float32)

    def _act_for(self, side: Side, features: torch.Tensor) -> torch.Tensor:
        """Actions [world, action] of one hand."""
        name, is_mirrored = acting_network(side, self._actors)
        seen = mirror_features(features) if is_mirrored else features
        observed = TensorDict({OBSERVATION_GROUP: seen[:, self._columns]}, batch_size=len(seen))
        actions: torch.Tensor = self._actors[name](observed)
        return mirror_actions(actions, features, self.task.action) if is_mirrored else actions
