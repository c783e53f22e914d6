"""Policy files: the trained networks with the task, hand and objects they were trained on."""

import json
import warnings
from collections import OrderedDict
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
from artigrasp.restricted_pickle import MAX_BYTES, check_bounded

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
    contents = _load_plain(path)
    check_format(contents.get("format"), contents.get("version"), POLICY_FORMAT, POLICY_VERSION, path)
    features = contents.get("features", 1)  # older files do not tell: there was but one version
    if type(features) is not int or features != FEATURES_VERSION:
        raise UserError(f"{path}: features: expected version {FEATURES_VERSION}, found {features}: train it anew")
    try:
        config = from_dict(TaskConfig, json.loads(_field(contents, "task", str)), source=f"{path}: task")
        objects = _field(contents, "objects", list)
        if not all(isinstance(name, str) for name in objects):
            raise ValueError(f"objects: expected names, found {objects}")
        policy = PolicyFile(
            task=config,
            hand=_field(contents, "hand", str),
            objects=tuple(objects),
            **{name: _field(contents, name, int) for name in ("seed", "iteration", "control_steps")},
            wall_time=float(_field(contents, "wall_time", int, float)),
            actors=_read_actors(contents, config),
            learner=_field(contents, "learner", dict, type(None)),
        )
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: expected a whole policy file, found a bad or missing field: {error}") from error
    if task is not None and config.name != task:
        raise UserError(f"{path}: task: expected a policy for {task!r}, found one for {config.name!r}")
    if not _fits(policy):
        raise UserError(f"{path}: actors: expected the weights of the task's networks, found others")
    return policy


def _fits(policy: PolicyFile) -> bool:
    """Whether the weights are those of the networks that the task asks for, which may be larger than all memory."""
    try:
        with torch.device("meta"), torch.random.fork_rng(devices=[]):
            actor = build_actor(policy.task.ppo, action_count(policy.task.action))
    except (RuntimeError, TypeError):  # sizes that are none
        return False
    shapes = {name: weights.shape for name, weights in actor.state_dict().items()}
    return all({name: weights.shape for name, weights in state.items()} == shapes for state in policy.actors.values())


def make_actors(policy: PolicyFile) -> dict[str, MLPModel]:
    """The policy's networks with their weights, by their names."""
    actors = {}
    for name, state in policy.actors.items():
        with torch.random.fork_rng(devices=[]):  # whoever draws random numbers meanwhile draws the same
            actors[name] = build_actor(policy.task.ppo, action_count(policy.task.action))
        actors[name].load_state_dict(state)
    return actors


def _load_plain(path: Path) -> dict[str, Any]:
    """The table of tensors and plain data in a file.

    Raises:
        UserError: There is no such file, or it holds something else.
    """
    if not path.is_file():
        raise UserError(f"{path}: expected a policy file, found none")
    try:
        with warnings.catch_warnings(action="ignore"):  # torch remarks on pickles that it then refuses
            contents = torch.load(path, map_location="cpu", weights_only=True)
        check_bounded(contents, MAX_BYTES + 4 * path.stat().st_size)
    except Exception as error:  # A damaged archive can fail in any way of zipfile, torch or the file system.
        raise UserError(
            f"{path}: expected a policy file with tensors and plain data only, found another file"
        ) from error
    if not isinstance(contents, dict):
        raise UserError(f"{path}: expected a policy file, found {type(contents).__name__}")
    return contents


def _field(contents: dict[str, Any], name: str, *types: type) -> Any:
    """A field of one of some types.

    Raises:
        ValueError: It is missing, or of another type.
    """
    value = contents.get(name)
    if type(value) not in types:
        expected = " or ".join(each.__name__ for each in types)
        raise ValueError(f"{name}: expected {expected}, found {type(value).__name__}")
    return value


def _read_actors(contents: dict[str, Any], task: TaskConfig) -> dict[str, dict[str, torch.Tensor]]:
    """The networks' states.

    Raises:
        ValueError: They are not those of the task, or hold what is no number.
    """
    if contents["version"] == 1:
        actors = dict.fromkeys(task.hands, _field(contents, "actor", dict, OrderedDict))
    else:
        actors = _field(contents, "actors", dict)
    if tuple(actors) != task.networks:
        raise ValueError(f"actors: expected {', '.join(task.networks)}, found {', '.join(map(str, actors)) or 'none'}")
    return {name: _read_weights(name, actors) for name in actors}


def _read_weights(name: str, actors: dict[str, Any]) -> dict[str, torch.Tensor]:
    weights = dict(_field(actors, name, dict, OrderedDict))
    for key, value in weights.items():
        is_dense = isinstance(value, torch.Tensor) and value.layout is torch.strided
        if not isinstance(key, str) or not is_dense or value.is_complex() or not torch.isfinite(value).all():
            raise ValueError(f"actors: {name}: {key}: expected finite numbers, found something else")
    return weights
