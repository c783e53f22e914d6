"""Small tasks that train in a moment."""

import functools
from dataclasses import replace

from artigrasp.config import TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.tasks import get_task
from artigrasp.training.vec_env import HandVecEnv
from tests.environment.examples import box_environment

WORLD_COUNT = 6


def small_synergy(interval: int = 10, episode_steps: int = 20) -> TaskConfig:
    """Our task with short episodes, whose decisions hold for an interval."""
    task = get_task("right-fixed-synergy")
    action = replace(
        task.action,
        synergy=replace(task.action.synergy, decision_interval=interval),
        approach_steps=5,
        close_start=2,
        close_end=8,
    )
    return replace(task, episode_steps=episode_steps, world_count=WORLD_COUNT, action=action)


def small_paper(episode_steps: int = 6) -> TaskConfig:
    """The paper's task with short episodes, one of them per iteration."""
    task = get_task("right-fixed")
    ppo = replace(task.ppo, steps_per_env=episode_steps, save_interval=2)
    return replace(task, episode_steps=episode_steps, world_count=WORLD_COUNT, ppo=ppo)


def make_env(task: TaskConfig, seed: int = 0) -> HandVecEnv:
    """Worlds of a task on the lidded box as rsl-rl sees them, at their beginning; the next of them ends this one."""
    environment = _environment(task, seed)
    environment.episode.zero_()
    return HandVecEnv(environment)


def make_new_env(task: TaskConfig, seed: int = 0) -> HandVecEnv:
    """The same, shared with nobody."""
    return HandVecEnv(box_environment(task, task.world_count, seed=seed))


@functools.cache
def _environment(task: TaskConfig, seed: int) -> Environment:
    return box_environment(task, task.world_count, seed=seed)
