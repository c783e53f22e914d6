"""Tests of `artigrasp refine-references`."""

import json
from pathlib import Path

import numpy as np
import pytest

from artigrasp.cli import main
from artigrasp.references.reference import load_references, read_references
from tests.cli.test_bad_input import refusal

QUICK = ["--iterations", "5", "--starts", "1"]
BOX = "lidded-box"


def test_refined_references_are_written_beside_the_others(
    work: Path, assets: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file has all references and the refined ones, says how they were made, and is used when it comes first."""
    original = (assets / "references" / f"{BOX}.npz").read_bytes()
    assert main(["refine-references", BOX, "--split", "test", *QUICK, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (assets / "references" / f"{BOX}.npz").read_bytes() == original
    file = work / "refined" / "references" / f"{BOX}.npz"
    assert report["files"] == [str(file.relative_to(work))] and report["references"] == 2
    references = read_references(file)
    assert references.split.tolist() == [*["train"] * 3, *["test"] * 2, *["test-refined"] * 2]
    provenance = json.loads(references.provenance)
    assert provenance["made_by"] == "refine-references" and provenance["settings"]["iterations"] == 5
    for moment in ("before", "after"):
        assert report[moment]["deepest_mm"]["trials"] == 2
        assert report[moment]["missing_contacts"]["largest"] <= report["target_contacts"]
    assert [row["source"] for row in report["per_reference"]] == references.source[3:5].tolist()
    assert report["after"]["deepest_mm"]["value"] == pytest.approx(
        np.mean([row["deepest_mm"][1] for row in report["per_reference"]])
    )
    monkeypatch.setenv("ARTIGRASP_ASSETS", f"{work / 'refined'}:{assets}")
    assert len(load_references(BOX).select(split="test-refined")) == 2


def test_the_table(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without --json the figures are a table; by default everything is refined that is not refined already."""
    assert main(["refine-references", BOX, *QUICK]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("5 references with ")
    assert "deepest point in the object [mm]" in shown and "wrote refined/references/lidded-box.npz" in shown


def test_bad_input(work: Path, assets: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """One line each, and nothing is written."""
    verb = "refine-references"
    assert refusal([verb], work, capfd) == "objects: expected at least one, found none"
    assert refusal([verb, "lidded-bux"], work, capfd) == "unknown object 'lidded-bux': did you mean 'lidded-box'?"
    assert "references of 'recon': found none" in refusal([verb, BOX, "--split", "recon"], work, capfd)
    message = refusal([verb, BOX, "--out", str(assets)], work, capfd)
    assert (
        message
        == f"{assets}/references/{BOX}.npz: these are the references to refine: choose another folder with --out"
    )
    assert refusal([verb, BOX, "--device", "cuda:9"], work, capfd).startswith("device: expected one of cpu")
    (work / "file").write_text("")
    assert "expected a folder" in refusal([verb, BOX, "--out", "file"], work, capfd)


@pytest.mark.parametrize(("flag", "value"), [("--iterations", "0"), ("--contact", "-1"), ("--stay-position", "0")])
def test_bad_settings(flag: str, value: str, work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A setting that makes no sense is refused by its name."""
    try:
        code = main(["refine-references", BOX, flag, value])
    except SystemExit as refused:
        code = refused.code
    assert code == 2
    assert flag[2:].replace("-", "_") in capsys.readouterr().err.replace("-", "_")
    assert not (work / "refined").exists()
