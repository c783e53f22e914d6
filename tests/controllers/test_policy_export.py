"""Exported policies decide as the policies that they were made of."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import torch
from onnx.reference import ReferenceEvaluator

from artigrasp.cli import main
from artigrasp.config.task import Side
from artigrasp.controllers.controller import PolicyController
from artigrasp.controllers.policy_export import describe_policy
from artigrasp.controllers.policy_file import PolicyFile, save_policy
from artigrasp.controllers.skills import in_free_scene
from artigrasp.environment.action_columns import action_count
from artigrasp.kernels.layout import DOFS, FEATURE_COUNT
from artigrasp.tasks import get_task
from tests.controllers.examples import example_policy

HANDS: tuple[Side, ...] = ("left", "right")


def with_statistics(policy: PolicyFile) -> PolicyFile:
    """The policy as if it had seen features that are not normal."""
    for state in policy.actors.values():
        for name, value in state.items():
            if "normalizer" in name and value.is_floating_point():
                value += 0.5 * torch.rand_like(value)
    return policy


def test_files_decide_as_the_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """TorchScript and ONNX, for any number of rows, of the hand that was trained and of the mirrored one."""
    policy = with_statistics(example_policy(get_task("right-fixed-synergy")))
    save_policy(policy, tmp_path / "policy.pt")
    out = tmp_path / "out"
    assert main(["export-policy", str(tmp_path / "policy.pt"), "--out", str(out), "--json"]) == 0
    assert sorted(map(Path, json.loads(capsys.readouterr().out)["paths"])) == sorted(out.iterdir())
    features = np.random.default_rng(0).normal(size=(5, 2, FEATURE_COUNT)).astype(np.float32)
    expected = in_free_scene(PolicyController(policy)).act(features)
    assert np.abs(expected).max() > 0.01 and np.abs(expected[:, 0] - expected[:, 1]).max() > 0.01
    for hand, side in enumerate(HANDS):
        seen = np.ascontiguousarray(features[:, hand])
        script = torch.jit.load(out / f"{side}.torchscript")
        np.testing.assert_allclose(script(torch.from_numpy(seen)).numpy(), expected[:, hand], atol=1e-6)
        (found,) = ReferenceEvaluator(str(out / f"{side}.onnx")).run(None, {"features": seen})
        np.testing.assert_allclose(found, expected[:, hand], rtol=1e-4, atol=1e-4)


def test_what_goes_in_and_comes_out_is_described() -> None:
    """Blocks that cover the features, and a name, a scale and an interval for every number of the action."""
    for name in ("right-fixed-synergy", "right-fixed"):
        task = get_task(name)
        described = json.loads(json.dumps(describe_policy(example_policy(task))))
        blocks = [block["columns"] for block in described["input"]["blocks"]]
        assert blocks[0][0] == 0 and blocks[-1][1] == FEATURE_COUNT
        assert all(before[1] == after[0] for before, after in itertools.pairwise(blocks))
        columns = described["output"]["columns"]
        assert len(columns) == action_count(task.action) == described["output"]["shape"][1]
        assert all(column["scale"] > 0 and column["decision_interval"] > 0 for column in columns)
    assert [column["name"] for column in columns] == list(DOFS) and columns[6]["scale"] == 0.015


def test_a_policy_that_there_is_not_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Before anything is written."""
    assert main(["export-policy", "liddedbox", "--out", str(tmp_path / "none")]) == 2
    assert "did you mean 'lidded-box'" in capsys.readouterr().err and not (tmp_path / "none").exists()
