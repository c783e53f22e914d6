"""What the documents say that the terminal says: in ``console`` blocks, a command after ``$`` and its error."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.library import find_asset
from artigrasp.cli import main
from tests.docs.blocks import read_blocks
from tests.docs.commands import DOCUMENTS

SESSIONS = [
    pytest.param(command, said, id=command)
    for document in DOCUMENTS
    for block in read_blocks(document)
    if block.language == "console"
    for command, said in re.findall(r"^\$ artigrasp (.*)\n((?:(?!\$ ).*\n)*)", block.text, flags=re.MULTILINE)
]


def test_there_are_sessions() -> None:
    """The blocks are found, and each command has something to say."""
    assert len(SESSIONS) > 15 and all(session.values[1] for session in SESSIONS)


@pytest.mark.parametrize(("command", "said"), SESSIONS)
def test_it_says_so(
    command: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mistake ends in these words, word by word, and in exit code 2."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARTIGRASP_ASSETS", "none")
    np.savez("future.npz", format="artigrasp.motion", version=99)
    Path("lidded-box.npz").write_bytes(find_asset("references", "lidded-box").read_bytes())
    Path("model.step").touch()
    Path("empty").mkdir()
    assert main(shlex.split(command)) == 2
    assert [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")] == said.splitlines()
