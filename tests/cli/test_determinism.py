"""The same words, the same numbers: bit for bit on one machine's processor."""

import json
from pathlib import Path

import pytest
import torch

from artigrasp.cli import main
from artigrasp.controllers.policy_file import load_policy


def test_two_trainings_learn_the_same(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every weight, after two iterations of simulation and learning."""
    policies = []
    for _ in range(2):
        assert main(["train", "quick", "--seed", "3", "--threads", "1", "--json"]) == 0
        policies.append(load_policy(Path(json.loads(capsys.readouterr().out)["folder"]) / "policy.pt"))
    first, second = (each.actors["right"] for each in policies)
    assert policies[0].iteration == 2 and all(torch.equal(first[name], second[name]) for name in first)


def test_two_evaluations_measure_the_same(work: Path) -> None:
    """Every column of every trial, whatever the number of threads and of worlds at once."""
    words = ["evaluate", "articulation", "--controller", "pd-ik", "--task", "quick"]
    tables = []
    for number, more in enumerate((["--threads", "1"], ["--threads", "2", "--worlds", "3"])):
        assert main([*words, *more, "--out", str(number)]) == 0
        tables.append(Path(str(number), "trials.csv").read_bytes())
    assert len(tables[0].splitlines()) == 11 and tables[0] == tables[1]
