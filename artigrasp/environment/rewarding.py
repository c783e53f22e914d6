"""How the hands of all worlds are rewarded."""

import warp as wp

from artigrasp.config import TaskConfig
from artigrasp.environment import tables
from artigrasp.environment.measuring import LIFTED_HEIGHT, OPENED_ANGLE
from artigrasp.environment.world_range import WorldRange
from artigrasp.kernels import outcomes, rewards
from artigrasp.simulation.launches import record


class Rewarding:
    """Rewards of the last control step.

    Attributes:
        total: [W, H] reward.
        terms: its terms by the kernel that computes them: names and [W, H, term] values.
    """

    def __init__(self, task: TaskConfig, object_mass: wp.array, hand_count: int) -> None:
        """Allocate.

        Args:
            task: What is rewarded.
            object_mass: [W] mass that caps the rewarded force, kg.
            hand_count: Hands in each world.
        """
        self._task, self._object_mass, self._device = task, object_mass, object_mass.device
        shape = (len(object_mass), hand_count)
        self._weights = tables.reward_weights(task.reward)
        self._outcome_weights = tables.outcome_weights(task.reward, self._device)
        self.total = wp.zeros(shape, dtype=float, device=self._device)
        self._paper_terms = wp.zeros((*shape, len(rewards.TERMS)), dtype=float, device=self._device)
        self._outcome_terms = wp.zeros((*shape, len(outcomes.OUTCOME_TERMS)), dtype=float, device=self._device)
        self.terms = ((rewards.TERMS, self._paper_terms), (outcomes.OUTCOME_TERMS, self._outcome_terms))

    def reward(self, worlds: WorldRange) -> list[wp.Launch]:
        """The kernels that reward a control step, at its end."""
        rows, objects, reward = worlds.rows, worlds.state.objects, self.total[worlds.rows]
        arguments = [
            worlds.state.hands, objects, worlds.object_model, worlds.goal, self._weights, self._object_mass[rows],
            self._paper_terms[rows], reward,
        ]  # fmt: skip
        launches = [record(rewards.compute_rewards, worlds.every_hand, arguments, self._device)]
        if self._outcome_weights is not None:
            arguments = [
                objects, worlds.goal, worlds.step_count, self._task.episode_steps, OPENED_ANGLE, LIFTED_HEIGHT,
                self._outcome_weights, self._outcome_terms[rows], reward,
            ]  # fmt: skip
            launches.append(record(outcomes.add_outcome_reward, worlds.every_hand, arguments, self._device))
        return launches
