"""Tests that documents do not fall behind: commands are understood, links lead somewhere, pictures are shown."""

import re
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path

import pytest

from artigrasp.cli.app import VERBS, parse
from tests.docs.commands import DOCUMENTS, ROOT, read_commands

CASES = [
    pytest.param(command.words, id=f"{command.document}: {' '.join(command.words)}")
    for document in DOCUMENTS
    for command in read_commands(document)
    if command.program == "artigrasp" and not {"--help", "--version", "NAME"} & set(command.words)
]

SUBCOMMANDS = ("render", "view")
"""Verbs that have verbs of their own, whose options their help leaves to those."""
OTHERS = {"--nproc-per-node", "--no-python", "--extra-index-url", "--disable-pip", "--no-deps"}
"""Options of torchrun, pip and pip-audit."""


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


def code(document: Path) -> str:
    """What of a document is in code, in a block or in a line."""
    return "\n".join(re.findall(r"```.*?```|`[^`]+`", document.read_text(encoding="utf-8"), flags=re.DOTALL))


@pytest.fixture(scope="module")
def flags() -> set[str]:
    """Every option of the verbs and of the tools, and those of other programs that documents name."""
    with redirect_stdout(StringIO()) as helped:
        for name in VERBS:
            with suppress(SystemExit):
                parse((name, "--help"))
    words = [helped.getvalue()]
    words += [path.read_text(encoding="utf-8") for path in (ROOT / "tools").glob("*.py")]
    found = set(re.findall(r"--[a-z][a-z-]*", "\n".join(words)))
    for name in SUBCOMMANDS:
        fields = re.findall(
            r"^    (\w+): ", (ROOT / f"artigrasp/cli/{name}.py").read_text(encoding="utf-8"), re.MULTILINE
        )
        found |= {f"--{no}{field.replace('_', '-')}" for field in fields for no in ("", "no-")}
    return found | OTHERS


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: str(each.relative_to(ROOT)))
def test_options_exist(document: Path, flags: set[str]) -> None:
    """Every option that a document names is one of some verb, of a tool, or of a program that it says."""
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", code(document)))
    assert not sorted(named - flags)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: str(each.relative_to(ROOT)))
def test_verbs_exist(document: Path) -> None:
    """What stands after the name of the program is a verb."""
    named = set(re.findall(r"\bartigrasp ([a-z][a-z-]+)", re.sub(r"^error.*", "", code(document), flags=re.MULTILINE)))
    assert named <= {*VERBS}


def test_verbs_are_documented() -> None:
    """Every verb is shown at work in the documentation."""
    text = "".join(code(document) for document in DOCUMENTS if document.parent.name == "docs")
    assert not [verb for verb in VERBS if f"artigrasp {verb}" not in text]


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
