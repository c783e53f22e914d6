"""Tests that documents do not fall behind: commands are understood, links lead somewhere, pictures are shown."""

import re
from pathlib import Path

import pytest

from artigrasp.cli.app import parse
from tests.docs.commands import DOCUMENTS, ROOT, read_commands

CASES = [
    pytest.param(command.words, id=f"{command.document}: {' '.join(command.words)}")
    for document in DOCUMENTS
    for command in read_commands(document)
    if command.program == "artigrasp" and not {"--help", "--version", "NAME"} & set(command.words)
]


def test_there_are_commands() -> None:
    """The documents are found and read."""
    assert len(CASES) > 150


@pytest.mark.parametrize("words", CASES)
def test_command_is_understood(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """Every command in a document has a verb and options that exist."""
    try:
        parse(words)
    except SystemExit:
        pytest.fail(capsys.readouterr().err)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: str(each.relative_to(ROOT)))
def test_tools_exist(document: Path) -> None:
    """Every program that a document runs or names is there."""
    named = set(re.findall(r"\btools/\w+\.py\b", document.read_text(encoding="utf-8")))
    assert not [name for name in named if not (ROOT / name).is_file()]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: str(each.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    """Links and pictures within the project point to files, and to headings that are there."""
    for link in re.findall(r"\]\(([^)\s]+)\)", document.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (document.parent / name).resolve() if name else document
        assert target.exists(), f"{link}: no such file"
        assert not anchor or anchor in anchors(target), f"{link}: no such heading"


def anchors(document: Path) -> set[str]:
    """The names that headings of a document have in links."""
    headings = re.findall(r"^#+ +(.+)$", document.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def test_pictures_are_shown() -> None:
    """No picture lies about that no document shows."""
    text = "".join(document.read_text(encoding="utf-8") for document in DOCUMENTS)
    pictures = [path for path in (ROOT / "docs" / "images").rglob("*") if path.is_file()]
    assert not [path.name for path in pictures if path.name not in text]
