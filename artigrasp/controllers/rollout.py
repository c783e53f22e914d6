"""One episode of a controller in every world."""

import logging
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
import warp as wp

from artigrasp.controllers.controller import Controller
from artigrasp.environment.environment import Environment
from artigrasp.environment.measuring import describe_failures

logger = logging.getLogger(__name__)

OnPlan = Callable[[int, int], None]
"""Told how many control steps of planning are done, and how many there are in all."""


@runtime_checkable
class Planner(Protocol):
    """A controller that must see the worlds before it acts in them."""

    @property
    def parallel_count(self) -> int:
        """Worlds in which it plans for one world at a time."""
        ...

    def plan(self, environment: Environment, on_plan: OnPlan) -> None:
        """Decide what to do in every world's next episode, and leave the environment as it is."""
        ...


def run_episode(
    environment: Environment,
    controller: Controller,
    on_step: Callable[[int], None] = lambda step: None,
    on_plan: OnPlan = lambda done, total: None,
) -> None:
    """Reset all worlds and let the controller act for one episode, after it has planned if it does so.

    Args:
        environment: Made for the controller's task.
        controller: What acts.
        on_step: Called with the number of control steps done: 0 after the reset, then after every step.
        on_plan: Called while a planner plans.
    """
    if controller.hand not in (None, environment.hand_name):
        logger.warning("the policy was trained with the hand %r, not with %r", controller.hand, environment.hand_name)
    if isinstance(controller, Planner):
        controller.plan(environment, on_plan)
    action_count = environment.action_count
    shape = (environment.world_count, environment.hand_count, max(action_count, 1))
    action = wp.zeros(shape, dtype=float, device=environment.device)
    before = environment.failure_counts()
    environment.reset()
    on_step(0)
    # worlds of a sequence begin their phases, and so decide, at any time
    interval = environment.task.action.decision_interval if action_count and len(environment.phases) == 1 else 1
    for step in range(environment.episode_steps):
        if action_count and step % interval == 0:
            action.assign(np.ascontiguousarray(controller.act(environment.observe().numpy())))
        environment.step(action)
        on_step(step + 1)
        if environment.is_over:
            break
    counts = {name: count - before[name] for name, count in environment.failure_counts().items()}
    if failures := describe_failures(counts):
        logger.warning("%s, of %d episodes", failures, environment.world_count)
