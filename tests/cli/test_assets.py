"""Tests of the verbs that make and check assets."""

import json
from pathlib import Path
from typing import Any

import pytest

from artigrasp.assets import check
from artigrasp.cli import main
from artigrasp.references import arctic


def test_import_passes_its_options_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the library is asked for and what it reports are the command line's, for people and for programs."""
    asked = []
    fit = {"pieces": 7, "open_edges": 2, "volume_ratio": 1.05}
    fit |= {f"{way}_{figure}_mm": 0.25 for way in ("outward", "inward") for figure in ("median", "p95")}

    def import_arctic(
        path: Path, objects: Any, destination: Any, progress: arctic.Progress, **more: Any
    ) -> arctic.ImportReport:
        progress("objects/box.usda", 0, 1)
        asked.append((path, objects, destination, more))
        parts = {"box": {"base": fit}}
        return arctic.ImportReport(tmp_path, ["objects/box.usda"], ["hands/mano_left.usda"], ["box 7: no hand"], parts)

    monkeypatch.setattr(arctic, "import_arctic", import_arctic)
    assert main(["import-arctic", "release"]) == 0
    text = capsys.readouterr().out
    assert f"wrote {tmp_path / 'objects/box.usda'}\n" in text and "skipped box 7: no hand\n" in text
    assert ["box", "base", "7", "1.050", "0.25", "0.25", "0.25", "0.25", "2"] in [
        line.split() for line in text.split("\n")
    ]
    assert "1 files written, 1 unchanged, 1 notes" in text
    words = ["import-arctic", "release", "--objects", "box", "laptop", "--destination", str(tmp_path), "--json"]
    assert main([*words, "--mano", "models", "--processes", "3"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "destination": str(tmp_path),
        "written": ["objects/box.usda"],
        "unchanged": ["hands/mano_left.usda"],
        "skipped": ["box 7: no hand"],
        "parts": {"box": {"base": fit}},
    }
    assert asked == [
        (Path("release"), None, None, {"mano": None, "processes": None}),
        (Path("release"), ("box", "laptop"), tmp_path, {"mano": Path("models"), "processes": 3}),
    ]


def test_import_from_a_wrong_folder_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder of something else is the user's mistake, in one line, and leaves no trace."""
    destination = tmp_path / "assets"
    assert main(["import-arctic", str(tmp_path), "--destination", str(destination)]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith(f"error: {tmp_path}: ") and captured.err.count("\n") == 1
    assert not destination.exists()


def test_check_tells_what_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Findings and facts are told to people and programs; only an error makes the exit code 1."""
    error = check.Finding("error", "scale", "expected metres, found millimetres", "scale it by 0.001")
    warning = check.Finding("warning", "mass", "expected 0.1 to 2 kg, found 9", "mend the masses")
    path = tmp_path / "tin.usda"
    monkeypatch.setattr(
        check,
        "check_asset",
        lambda path: check.AssetReport(path, "artigrasp.object", {"size_m": 0.5}, (error, warning)),
    )
    assert main(["check-asset", str(path)]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "size_m:  0.5",
        "error: scale: expected metres, found millimetres; scale it by 0.001",
        "warning: mass: expected 0.1 to 2 kg, found 9; mend the masses",
        f"{path}: cannot be simulated",
    ]
    assert main(["check-asset", str(path), "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "path": str(path),
        "format": "artigrasp.object",
        "usable": False,
        "facts": {"size_m": 0.5},
        "findings": [
            {
                "severity": "error",
                "field": "scale",
                "problem": "expected metres, found millimetres",
                "remedy": "scale it by 0.001",
            },
            {
                "severity": "warning",
                "field": "mass",
                "problem": "expected 0.1 to 2 kg, found 9",
                "remedy": "mend the masses",
            },
        ],
    }
    monkeypatch.setattr(check, "check_asset", lambda path: check.AssetReport(path, "artigrasp.hand", {}, (warning,)))
    assert main(["check-asset", str(path)]) == 0


def test_check_of_nothing_is_the_users_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A path to nothing and a file that is no USD are refused in one line each."""
    (tmp_path / "note.usda").write_text("nothing")
    for name in ("missing.usda", "note.usda"):
        assert main(["check-asset", str(tmp_path / name)]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and name in captured.err and captured.err.count("\n") == 1
