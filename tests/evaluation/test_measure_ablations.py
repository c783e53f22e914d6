"""Tasks side by side, with several seeds each."""

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import Run
from tools.measure_ablations import Measured, gather, keep_settings, plot, table


def run(folder: Path, successes: list[bool]) -> Run:
    """An evaluation of one trial for each reference of a box."""
    trials = {
        ("box", str(index), "", "0"): {
            "success_paper": str(success),
            "angle_error": str(1.0 - success),
            "mean_displacement": str(0.1 * index),
        }
        for index, success in enumerate(successes)
    }
    return Run(folder, {}, trials)


def measured(tmp_path: Path, task: str, seeds: list[list[bool]]) -> Measured:
    """What a tool that has trained and evaluated these seeds knows."""
    folders = [tmp_path / f"{task}{seed}" for seed in range(len(seeds))]
    for seed, folder in enumerate(folders):
        folder.mkdir()
        (folder / "done").write_text(json.dumps({"cpu_time": 60.0 * (seed + 1)}))
    runs = [run(folder, each) for folder, each in zip(folders, seeds, strict=True)]
    return gather(task, folders, runs, range(len(seeds)))


def test_seeds_are_paired_and_references_counted(tmp_path: Path) -> None:
    """A task is compared with the seeds that it shares with the first, and trials of a reference count as one."""
    whole = measured(tmp_path, "whole", [[True, True, True, False]] * 3)
    part = measured(tmp_path, "part", [[True, False, False, False], [True, True, False, False]])
    assert whole.rate().value == 0.75 and whole.rate().trials == 12
    once = measured(tmp_path, "once", [[True, True, True, False]]).rate()
    assert (whole.rate().low, whole.rate().high) == pytest.approx((once.low, once.high)), "seeds add no references"
    assert part.gain(whole).value == pytest.approx(-3 / 8) and part.gain(whole).trials == 8
    np.testing.assert_array_equal(part.angle_error, 1.0 - part.success)
    assert part.mean(part.displacement).value == pytest.approx(0.15)


def test_the_table_says_what_each_seed_did(tmp_path: Path) -> None:
    """A row for each task; the first is what the others are compared with."""
    rows = [measured(tmp_path, "whole", [[True, True], [True, False]]), measured(tmp_path, "part", [[False, False]])]
    lines = table(rows).splitlines()
    assert "0.750" in lines[2] and "1.000, 0.500" in lines[2] and "1.5" in lines[2]
    assert "0.000" in lines[3] and "-1.000" in lines[3]
    plot(rows, tmp_path / "comparison.png")
    assert (tmp_path / "comparison.png").stat().st_size > 1000


def test_a_folder_is_of_one_comparison(tmp_path: Path) -> None:
    """Trainings that were longer, or goals that were others, would be compared as if they were alike."""
    options = argparse.Namespace(
        out=tmp_path, objects=["box"], control_steps=1000, worlds=8, scene="both-free", goal_angles=[1.0], seeds=[0]
    )
    keep_settings(options)
    options.seeds = [0, 1]
    keep_settings(options)
    options.control_steps = 2000
    with pytest.raises(UserError, match=r"settings\.json: control_steps: expected 2000, found 1000: choose another"):
        keep_settings(options)
