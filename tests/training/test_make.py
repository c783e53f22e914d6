"""The environments that tasks are trained in."""

from dataclasses import replace

import numpy as np
import torch

from artigrasp.config import TaskConfig
from artigrasp.tasks import get_task
from artigrasp.training.make import make_training_environment
from artigrasp.training.vec_env import HandVecEnv

WORLDS, STEPS = 4, 30


def short_grasp() -> TaskConfig:
    """Our grasping task with few worlds, whose episodes are too short to grasp anything."""
    task = get_task("both-grasp-replay")
    synergy = replace(task.action.synergy, decision_interval=STEPS)
    return replace(task, world_count=WORLDS, episode_steps=STEPS, action=replace(task.action, synergy=synergy))


def test_grasps_are_learned_while_they_are_carried() -> None:
    """The whole sequence with the policy's priors in its first phase, and a target in the air for every world."""
    environment = make_training_environment(replace(get_task("both-grasp-replay"), world_count=WORLDS), ["lidded-box"])
    assert [phase.name for phase in environment.phases] == ["grasp", "relocate", "hold"]
    assert [phase.decides for phase in environment.phases] == [True, False, False]
    assert environment.episode_steps == environment.task.episode_steps
    environment.reset()
    start, target = environment.goal.start_object_pose.numpy(), environment.goal.target_object_pose.numpy()
    rise = target[:, 2] - start[:, 2]
    assert ((rise > 0.149) & (rise < 0.451)).all() and len(np.unique(rise)) == environment.world_count


def test_idle_hands_earn_nothing() -> None:
    """Rewards come at the end, to hands that take part: here the distance of what is not carried from its target."""
    environment = make_training_environment(short_grasp(), ["lidded-box"])
    env = HandVecEnv(environment)
    _, rewards, dones, extras = env.step(torch.zeros(env.rows, env.num_actions))
    assert dones.all()
    assert (rewards[extras["active"] == 0] == 0).all() and (rewards[extras["active"] == 1] < 0).any()
