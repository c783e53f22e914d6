"""Policies for programs that have neither this package nor rsl-rl: TorchScript and ONNX."""

import logging
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import torch
from rsl_rl.models import MLPModel
from torch import nn

from artigrasp.config import ActionConfig, TaskConfig, to_dict
from artigrasp.config.task import Side
from artigrasp.controllers.controller import acting_network
from artigrasp.controllers.mirror import mirror_actions, mirror_features
from artigrasp.controllers.network import observed_columns
from artigrasp.controllers.policy_file import PolicyFile, make_actors
from artigrasp.environment.action_columns import synergy_directions, synergy_scales
from artigrasp.files import atomic_write, write_json
from artigrasp.kernels.layout import DOFS, FEATURE_COUNT, FEATURES, FEATURES_VERSION, feature_slice

FORMAT, VERSION = "artigrasp.exported-policy", 1
EXAMPLE_ROWS = 2
"""Rows of the example that a network is traced with; any number goes in later."""


class HandPolicy(nn.Module):
    """What one hand does: its features [row, 279] to its action [row, number], the mean of the policy's distribution.

    Choice and normalisation of the features are part of it, and the mirror for a hand that another one's network acts
    for.
    """

    def __init__(self, actor: MLPModel, columns: list[int], action: ActionConfig, is_mirrored: bool) -> None:
        """Take a network apart into what can be exported."""
        super().__init__()
        self._columns, self._action, self._is_mirrored = columns, action, is_mirrored
        self.normalizer, self.mlp = actor.obs_normalizer, actor.mlp

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """The action of every row."""
        seen = mirror_features(features) if self._is_mirrored else features
        action: torch.Tensor = self.mlp(self.normalizer(seen[:, self._columns]))
        return mirror_actions(action, features, self._action) if self._is_mirrored else action


def hand_policies(policy: PolicyFile) -> dict[Side, HandPolicy]:
    """What each hand does, by its side."""
    actors = {name: actor.eval() for name, actor in make_actors(policy).items()}
    columns, result = observed_columns(policy.task.ppo), {}
    for side in get_args(Side):
        name, is_mirrored = acting_network(side, tuple(actors))
        module = HandPolicy(actors[name], columns, policy.task.action, is_mirrored)
        result[side] = module.eval().requires_grad_(False)
    return result


def export_policy(
    policy: PolicyFile, folder: Path, on_file: Callable[[int, int], None] = lambda done, total: None
) -> list[Path]:
    """Write ``left.torchscript``, ``left.onnx``, the same of the right hand, and ``policy.json``, which describes them.

    Args:
        policy: The policy.
        folder: Where to; files of these names are replaced.
        on_file: Told how many files are written, and how many there will be.

    Returns:
        The files.
    """
    example = torch.zeros(EXAMPLE_ROWS, FEATURE_COUNT)
    paths: list[Path] = []
    modules = hand_policies(policy)
    for side, module in modules.items():
        for kind, write in (("torchscript", _write_torchscript), ("onnx", _write_onnx)):
            on_file(len(paths), 1 + 2 * len(modules))
            paths.append(folder / f"{side}.{kind}")
            with atomic_write(paths[-1]) as path:
                write(module, example, path)
    paths.append(folder / "policy.json")
    write_json(paths[-1], describe_policy(policy))
    on_file(len(paths), len(paths))
    return paths


def describe_policy(policy: PolicyFile) -> dict[str, Any]:
    """What goes into the exported networks and what comes out, in plain data."""
    task = policy.task
    inputs = []
    for feature in FEATURES:
        columns = feature_slice(feature.name)
        inputs.append(
            {
                "name": feature.name,
                "columns": [columns.start, columns.stop],
                "frame": feature.frame,
                "unit": feature.unit,
            }
        )
    return {
        "format": FORMAT,
        "version": VERSION,
        "hand": policy.hand,
        "objects": list(policy.objects),
        "trained_for": {name: getattr(policy, name) for name in ("seed", "iteration", "control_steps", "wall_time")},
        "features_version": FEATURES_VERSION,
        "input": {"name": "features", "shape": ["row", FEATURE_COUNT], "blocks": inputs},
        "output": {"name": "action", "shape": ["row", len(_describe_action(task))], "columns": _describe_action(task)},
        "task": to_dict(task),
    }


def _describe_action(task: TaskConfig) -> list[dict[str, Any]]:
    """Name, scale [m | rad] and decision interval [control steps] of every number of an action."""
    action, columns = task.action, []
    if action.synergy is not None:
        scales, interval = synergy_scales(action.synergy), action.synergy.decision_interval
        for name in synergy_directions(action.synergy):
            columns.append({"term": "synergy", "name": name, "scale": scales[name], "decision_interval": interval})
    if (residual := action.residual) is not None:
        sizes = [residual.wrist_translation] * 3 + [residual.wrist_rotation] * 3 + [residual.fingers] * (len(DOFS) - 6)
        for name, scale in zip(DOFS, sizes, strict=True):
            interval = residual.decision_interval
            columns.append({"term": "residual", "name": name, "scale": scale, "decision_interval": interval})
    return columns


def _write_torchscript(module: HandPolicy, example: torch.Tensor, path: Path) -> None:
    with torch.no_grad(), warnings.catch_warnings(action="ignore"):  # TorchScript is no longer developed, and says so
        module(example)  # what is computed once and kept must not become part of the trace
        torch.jit.trace(module, example).save(str(path))  # type: ignore[no-untyped-call]


def _write_onnx(module: HandPolicy, example: torch.Tensor, path: Path) -> None:
    loud = [logging.getLogger(name) for name in ("torch.onnx", "onnxscript", "onnx_ir")]
    levels = [each.level for each in loud]
    try:
        for each in loud:
            each.setLevel(logging.ERROR)
        with warnings.catch_warnings(action="ignore"):
            torch.onnx.export(
                module,
                (example,),
                str(path),
                input_names=["features"],
                output_names=["action"],
                dynamic_shapes={"features": {0: torch.export.Dim("row")}},
                external_data=False,
                verbose=False,
            )
    finally:
        for each, level in zip(loud, levels, strict=True):
            each.setLevel(level)
