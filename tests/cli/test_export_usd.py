"""Tests of `artigrasp export-usd`."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from artigrasp.cli import main
from artigrasp.export import usd
from artigrasp.motion.file import Motion, save_motion
from tests.motion.example import example_motion

Call = tuple[list[Motion], Path, float | None, str]


@pytest.fixture
def exported(monkeypatch: pytest.MonkeyPatch) -> list[Call]:
    """What the library was asked to export."""
    calls: list[Call] = []
    monkeypatch.setattr(
        usd, "export_usd", lambda motions, path, *, rate, hands: calls.append((motions, path, rate, hands))
    )
    return calls


def test_motion_is_exported_beside_its_file_or_where_asked(
    tmp_path: Path, exported: list[Call], capsys: pytest.CaptureFixture[str]
) -> None:
    """The path and the rate are passed on, and the file that was written is named."""
    path = tmp_path / "motion.npz"
    save_motion(path, example_motion())
    assert main(["export-usd", str(path)]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'motion.usdc'}\n"
    out = ["--out", str(tmp_path / "a.usda"), "--rate", "30", "--hands", "baked", "--json"]
    assert main(["export-usd", str(path), str(path), *out]) == 0
    assert json.loads(capsys.readouterr().out) == {"path": str(tmp_path / "a.usda")}
    assert exported[0][1:] == (tmp_path / "motion.usdc", None, "skinned")
    assert exported[1][1:] == (tmp_path / "a.usda", 30.0, "baked")
    assert [[motion.object for motion in call[0]] for call in exported] == [["lidded-box"], ["lidded-box"] * 2]


def test_no_motion_is_refused(exported: list[Call], capsys: pytest.CaptureFixture[str]) -> None:
    """A motion is what it is about."""
    assert main(["export-usd"]) == 2
    assert not exported and capsys.readouterr().err


def test_what_is_no_motion_is_refused(tmp_path: Path, exported: list[Call], capsys: pytest.CaptureFixture[str]) -> None:
    """A missing file and a file of something else are refused in one line, and nothing is written."""
    (tmp_path / "note.npz").write_text("nothing")
    for name in ("note.npz", "missing.npz"):
        assert main(["export-usd", str(tmp_path / name)]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and name in captured.err and captured.err.count("\n") == 1
    assert not exported and [path.name for path in tmp_path.iterdir()] == ["note.npz"]


def test_only_results_are_seen(tmp_path: Path) -> None:
    """Run as a program, the verb writes a USD file and says so; notes of the libraries stay away from both streams."""
    save_motion(tmp_path / "motion.npz", example_motion())
    program = "import sys; from artigrasp.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", program, "export-usd", "motion.npz", "--out", "motion.usda"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    assert done.stdout == "wrote motion.usda\n"
    assert not [line for line in done.stderr.splitlines() if not line.startswith("Compiling kernels")]
    assert (tmp_path / "motion.usda").read_text().startswith("#usda")
