"""Every command in the documents does what it is there for, with little of everything."""

import importlib
import sys
from pathlib import Path

import pytest

from artigrasp.cli import main
from tests.docs.commands import DOCUMENTS, ROOT, Command, read_commands
from tests.docs.desk import ASSETS
from tests.docs.reducing import more_words, reduced

HISTORY = ROOT / "CHANGELOG.md"
FOLLOWED = ROOT / "docs" / "extending.md"
"""Whose blocks `test_extending.py` follows, in sources that have what it adds."""

NOT_RUN = {
    "make demo": "tests/cli/test_demo.py carries and opens an object",
    "artigrasp demo --object open-waffle-iron": "tests/cli/test_demo.py does",
    "make test": "runs this",
    "source .venv/bin/activate": "is for the reader's shell",
    "tools.author_gallery": "writes the page and the pictures that are shown",
    "tools.fuzz_readers": "tests/test_readers.py does the same, less often",
    "tools.interrupt_commands": "kills processes for minutes; tests/training/test_interruptions.py kills one",
    "tools.interrupt_import": "kills processes for minutes",
    "tools.measure_ablations": "runs processes of its own, of verbs that are run here",
    "tools.measure_variants": "runs processes of its own, of verbs that are run here",
    "tools.measure_extraction": "measures recordings of ARCTIC itself, of which there is no likeness",
    "tools.measure_viewer": "needs a browser",
    "tools.search_readers": "needs atheris, which is to be installed by hand",
}
"""Commands, or programs of the tools, that are not run here, and why."""


def reason_not_to_run(command: Command) -> str:
    """Why a command is not run, or nothing."""
    return NOT_RUN.get(command.program) or NOT_RUN.get(" ".join([command.program, *command.words]), "")


EVERY = [
    command
    for document in DOCUMENTS
    if document != HISTORY
    for command in read_commands(document, fenced=document != FOLLOWED)
]
RUN = [each for each in EVERY if not reason_not_to_run(each)]
CASES = dict.fromkeys(reduced(each) for each in RUN if more_words(each) is not None)


@pytest.mark.parametrize("command", CASES, ids=str)
def test_command(command: Command, desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends well."""
    for name, value in {"ARTIGRASP_ASSETS": ASSETS, "ARTIGRASP_CACHE": "cache", **dict(command.environment)}.items():
        monkeypatch.setenv(name, value)
    assert run(command, monkeypatch) == 0


def run(command: Command, monkeypatch: pytest.MonkeyPatch) -> int | str | None:
    """The exit code of a command that runs in this process."""
    if command.program == "artigrasp":
        return main(command.words)
    if command.program == "python":
        exec(command.words[1])
        return 0
    tool = importlib.import_module(command.program)
    monkeypatch.setattr(sys, "argv", [command.program, *command.words])
    try:
        return tool.main() or 0
    except SystemExit as end:
        return end.code or 0


def test_every_program_is_known() -> None:
    """Of each is said in FEWER or QUICK how to make it take seconds, or in NOT_RUN why it is not run."""
    assert not [str(each) for each in RUN if more_words(each) is None]


def test_what_is_not_run_is_there() -> None:
    """No reason is kept for a command that no document has any more."""
    assert not [start for start in NOT_RUN if not any(reason_not_to_run(each) == NOT_RUN[start] for each in EVERY)]
