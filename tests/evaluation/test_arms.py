"""Policies that are trained alike, side by side."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.evaluation.comparison import Run
from tools import measure_variants
from tools.arms import Measured, Protocol, gather
from tools.measure_ablations import plot, table


def measured(name: str, seeds: list[list[bool]], objects: tuple[str, ...] = ("box",)) -> Measured:
    """What a tool knows that has trained and evaluated these seeds; trials go through the objects in turn."""
    runs = []
    for successes in seeds:
        trials = {
            (objects[index % len(objects)], str(index), "", "0"): {
                "success_paper": str(success),
                "angle_error": str(1.0 - success),
                "mean_displacement": str(0.1 * index),
            }
            for index, success in enumerate(successes)
        }
        runs.append(Run(Path(name), {}, trials))
    return gather(name, range(len(seeds)), [60.0 * (seed + 1) for seed in range(len(seeds))], runs)


def test_seeds_are_paired_and_references_counted() -> None:
    """A task is compared with the seeds that it shares with the first, and trials of a reference count as one."""
    whole = measured("whole", [[True, True, True, False]] * 3)
    part = measured("part", [[True, False, False, False], [True, True, False, False]])
    assert whole.rate().value == 0.75 and whole.rate().trials == 12
    once = measured("once", [[True, True, True, False]]).rate()
    assert (whole.rate().low, whole.rate().high) == pytest.approx((once.low, once.high)), "seeds add no references"
    assert part.gain(whole).value == pytest.approx(-3 / 8) and part.gain(whole).trials == 8
    np.testing.assert_array_equal(part.angle_error, 1.0 - part.success)
    assert part.mean(part.displacement).value == pytest.approx(0.15)


def test_the_table_says_what_each_seed_did(tmp_path: Path) -> None:
    """A row for each task; the first is what the others are compared with."""
    rows = [measured("whole", [[True, True], [True, False]]), measured("part", [[False, False]])]
    lines = table(rows).splitlines()
    assert "0.750" in lines[2] and "1.000, 0.500" in lines[2] and "1.5" in lines[2]
    assert "0.000" in lines[3] and "-1.000" in lines[3]
    plot(rows, tmp_path / "comparison.png")
    assert (tmp_path / "comparison.png").stat().st_size > 1000


def test_a_folder_is_of_one_comparison(tmp_path: Path) -> None:
    """Trainings that were longer, or goals that were others, would be compared as if they were alike."""
    protocol = Protocol(1000, 8, "both-free", (1.0,), "test")
    protocol.keep(tmp_path)
    protocol.keep(tmp_path)
    with pytest.raises(UserError, match=r"settings\.json: control_steps: expected 2000, found 1000: choose another"):
        replace(protocol, control_steps=2000).keep(tmp_path)


def test_variants_are_compared_with_the_prior_and_by_category(tmp_path: Path) -> None:
    """One seed of the prior is paired with all of a policy; a policy that never saw a category, with one that did."""
    options = argparse.Namespace(
        task="right-free-replay", counts=[1, 2], unseen=[1000], left_out=["box", "mixer"], left_out_count=2
    )
    unseen = measure_variants.variants([1000], ("box", "mixer"))
    arms = {
        measure_variants.PRIOR: measured("prior", [[False, False, True, False]], unseen),
        "1-of-each": measured("1-of-each", [[True, False, True, False]] * 2, unseen),
        "2-of-each": measured("2-of-each", [[True, True, True, False], [True, True, True, True]], unseen),
    }
    lines = measure_variants.count_table(arms).splitlines()
    assert "0.250" in lines[2] and "0.500" in lines[3] and "0.250" in lines[3]
    assert "0.750, 1.000" in lines[4] and "0.875" in lines[4] and "| 16 |" in lines[4]
    alone = {"without-mixer": measured("without-mixer", [[False, False]], unseen[1:])}
    lines = measure_variants.left_out_table(arms, alone, options).splitlines()
    assert len(lines) == 3 and lines[2].startswith("| mixer | 2 | 0.000") and "-0.500" in lines[2]
    measure_variants.plot(arms, tmp_path / "variants.png")
    assert (tmp_path / "variants.png").stat().st_size > 1000
    names = [arm.name for arm in measure_variants.left_out_arms(options)]
    assert names == ["without-box", "without-mixer"]
    assert "open-box-1" not in measure_variants.left_out_arms(options)[0].objects
