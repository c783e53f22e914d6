"""Policy files: the trained networks with the task, hand and objects they were trained on."""

import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from rsl_rl.models import MLPModel

from artigrasp.config import TaskConfig, from_dict, to_dict
from artigrasp.controllers.network import build_actor
from artigrasp.environment.action_columns import action_count
from artigrasp.errors import UserError
from artigrasp.files import atomic_write, check_format
from artigrasp.kernels.layout import FEATURES_VERSION

POLICY_FORMAT, POLICY_VERSION = "artigrasp.policy", 2
"""Version 1 had one network, which acted for every hand as it was."""


@dataclass(frozen=True)
class PolicyFile:
    """Contents of a policy file; the checkpoint of a training run is one that also holds the learner's state."""

    task: TaskConfig
    hand: str
    """Name of the hand model."""
    objects: tuple[str, ...]
    """Objects it was trained on."""
    seed: int
    iteration: int
    """PPO iterations done."""
    control_steps: int
    """Control steps simulated so far, over all worlds."""
    wall_time: float
    """Training time so far [s]."""
    actors: dict[str, dict[str, torch.Tensor]]
    """States of the actor networks, by the task's names of them: ``left`` and ``right``, or ``mirrored``."""
    learner: dict[str, Any] | None = None
    """Critics, optimizers, random generators and more, to resume from."""


def save_policy(policy: PolicyFile, target: Path) -> None:
    """Write a policy file."""
    contents = {
        "format": POLICY_FORMAT,
        "version": POLICY_VERSION,
        "features": FEATURES_VERSION,
        "task": json.dumps(to_dict(policy.task)),
        "objects": list(policy.objects),
        **{name: getattr(policy, name) for name in ("hand", "seed", "iteration", "control_steps", "wall_time")},
        "actors": policy.actors,
        "learner": policy.learner,
    }
    with atomic_write(target) as path:
        torch.save(contents, path)


def load_policy(path: Path, task: str | None = None) -> PolicyFile:
    """Read a policy file without running any code in it.

    Args:
        path: A file that :func:`save_policy` wrote.
        task: Name of the task it must be for; any if None.

    Raises:
        UserError: The file is missing, is no policy, holds objects other than tensors and plain data, was written by
            a newer version, saw other features, or belongs to another task.
    """
    if not path.is_file():
        raise UserError(f"{path}: expected a policy file, found none")
    try:
        with warnings.catch_warnings(action="ignore"):  # torch remarks on pickles that it then refuses
            contents = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # A damaged archive can fail in any way of zipfile, torch or the file system.
        raise UserError(
            f"{path}: expected a policy file with tensors and plain data only, found another file"
        ) from error
    if not isinstance(contents, dict):
        raise UserError(f"{path}: expected a policy file, found {type(contents).__name__}")
    check_format(contents.get("format"), contents.get("version"), POLICY_FORMAT, POLICY_VERSION, path)
    features = contents.get("features", 1)  # older files do not tell: there was but one version
    if features != FEATURES_VERSION:
        raise UserError(f"{path}: features: expected version {FEATURES_VERSION}, found {features}: train it anew")
    try:
        config = from_dict(TaskConfig, json.loads(contents["task"]), source=f"{path}: task")
        policy = PolicyFile(
            task=config,
            hand=str(contents["hand"]),
            objects=tuple(str(name) for name in contents["objects"]),
            seed=int(contents["seed"]),
            iteration=int(contents["iteration"]),
            control_steps=int(contents["control_steps"]),
            wall_time=float(contents["wall_time"]),
            actors=_read_actors(contents, config),
            learner=contents["learner"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: expected a whole policy file, found a bad or missing field: {error}") from error
    if task is not None and config.name != task:
        raise UserError(f"{path}: task: expected a policy for {task!r}, found one for {config.name!r}")
    try:
        make_actors(policy)
    except (AttributeError, RuntimeError, TypeError) as error:
        raise UserError(f"{path}: actors: expected the weights of the task's networks, found others") from error
    return policy


def make_actors(policy: PolicyFile) -> dict[str, MLPModel]:
    """The policy's networks with their weights, by their names."""
    actors = {}
    for name, state in policy.actors.items():
        with torch.random.fork_rng(devices=[]):  # whoever draws random numbers meanwhile draws the same
            actors[name] = build_actor(policy.task.ppo, action_count(policy.task.action))
        actors[name].load_state_dict(state)
    return actors


def _read_actors(contents: dict[str, Any], task: TaskConfig) -> dict[str, dict[str, torch.Tensor]]:
    """The networks' states.

    Raises:
        ValueError: They are not those of the task.
    """
    if contents["version"] == 1:
        return {name: dict(contents["actor"]) for name in task.hands}
    actors = {str(name): dict(state) for name, state in contents["actors"].items()}
    if tuple(actors) != task.networks:
        raise ValueError(f"actors: expected {', '.join(task.networks)}, found {', '.join(actors) or 'none'}")
    return actors
