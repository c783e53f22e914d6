"""Tests of `artigrasp synthesize-references`."""

import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.cli import main
from artigrasp.kernels.layout import ARTICULATED, BASE
from artigrasp.references.reference import load_references, read_references
from tests.cli.test_bad_input import refusal

VERB, BOX = "synthesize-references", "lidded-box"
QUICK = ["--kinds", "articulate-left", "--candidates", "12", "--draws", "4", "--iterations", "50", "--samples", "800"]
PHYSICS = ["--count", "3", "--trials", "1", "--rollouts", "0", "--threads", "1"]


def test_left_hands_open_the_box(
    work: Path, assets: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From nothing but the box: kept references work, touch the lid, and say how they came to be; nothing is redone."""
    assert main([VERB, BOX, *QUICK, *PHYSICS, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)["objects"][BOX]["articulate-left"]
    file = work / "synthesised" / "references" / f"{BOX}.npz"
    references = read_references(file)
    assert report["kept"] == len(references) == report["pd_ik"] >= 1
    assert report["fitted"] == 12 >= report["sound"] >= report["tried"] >= report["kept"]
    assert report["deepest_mm"] < 3
    assert references.active.tolist() == [[True, False]] * len(references)
    assert (references.part == [ARTICULATED, BASE]).all() and (references.contacts[:, 0].sum(axis=1) >= 2).all()
    np.testing.assert_array_equal(references.contacts[:, 1], False)
    assert set(references.split.tolist()) <= {"train", "test"} and references.split[0] == "train"
    made = json.loads(references.provenance)
    assert made["made_by"] == VERB and made["settings"]["seed"] == 0 and made["hand"] == "open"
    records = made["grips"]["articulate-left"]["references"]
    assert [each["source"] for each in records] == references.source.tolist()
    assert all(each["verdict"] == "pd-ik" and each["energy"] > 0 for each in records)

    written = file.stat().st_mtime_ns
    assert main([VERB, BOX, *QUICK, *PHYSICS]) == 0
    assert file.stat().st_mtime_ns == written
    assert capsys.readouterr().out.splitlines()[1].split()[:3] == [BOX, "articulate-left", "12"]
    other = [VERB, BOX, *QUICK, *PHYSICS, "--seed", "1"]
    assert main(other) == 2 and "found others: add --overwrite" in capsys.readouterr().err
    monkeypatch.setenv("ARTIGRASP_ASSETS", f"{work / 'synthesised'}:{assets}")
    assert len(load_references(BOX)) == len(references)


def test_sound_grips_are_kept_untested(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without physics those that it is not asked about are kept, and say so."""
    assert main([VERB, BOX, *QUICK, *PHYSICS, "--untested", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)["objects"][BOX]["articulate-left"]
    references = read_references(work / "synthesised" / "references" / f"{BOX}.npz")
    assert (report["tried"], report["pd_ik"], report["kept"]) == (0, 0, len(references)) and len(references) == 3
    made = json.loads(references.provenance)
    assert made["untested"] and {each["verdict"] for each in made["grips"]["articulate-left"]["references"]} == {""}


def test_what_hands_cannot_do_is_said(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One hand does not span the box: nothing is written, and that is no error."""
    assert main([VERB, BOX, "--kinds", "grasp-right", *PHYSICS]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == [BOX, "grasp-right", *["0"] * 6]
    assert not (work / "synthesised" / "references").exists()


def test_bad_input(work: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """One line each, and nothing is written."""
    assert refusal([VERB], work, capfd) == "objects: expected at least one, found none"
    assert refusal([VERB, "lidded-bux"], work, capfd) == "unknown object 'lidded-bux': did you mean 'lidded-box'?"
    assert refusal([VERB, BOX, "--count", "0"], work, capfd) == "count: expected a positive number, found 0"
    assert "unknown hand 'claw_left'" in refusal([VERB, BOX, "--hand", "claw"], work, capfd)
