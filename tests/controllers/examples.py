"""A policy that was never trained."""

from typing import Any

import torch

from artigrasp.config import TaskConfig
from artigrasp.controllers.network import build_actor
from artigrasp.controllers.policy_file import PolicyFile
from artigrasp.environment.action_columns import action_count


def example_policy(task: TaskConfig, **changes: Any) -> PolicyFile:
    """Random weights for a task."""
    torch.manual_seed(0)
    shape = task.ppo, action_count(task.action)
    fields: dict[str, Any] = {
        "task": task,
        "hand": "open",
        "objects": ("lidded-box",),
        "seed": 3,
        "iteration": 7,
        "control_steps": 1200,
        "wall_time": 1.5,
        "actors": {name: build_actor(*shape).state_dict() for name in task.networks},
    }
    return PolicyFile(**(fields | changes))
