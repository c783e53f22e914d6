"""The snippets of Python in the documents run."""

from pathlib import Path

import pytest

from artigrasp.cli import main
from tests.docs.blocks import read_blocks
from tests.docs.commands import DOCUMENTS, ROOT

FOLLOWED = ROOT / "docs" / "extending.md"
"""What `test_extending.py` runs."""
NOT_RUN = {"smplx": "needs a licensed copy of MANO"}
"""What is in snippets that are not run, and why."""
MADE = {"docs/policies.md": ["export-policy", "lidded-box", "--out", "exported"]}
"""What a document has made before its snippet."""

SNIPPETS = {
    str(document.relative_to(ROOT)): [
        block.text
        for block in read_blocks(document)
        if block.language == "python" and not any(reason in block.text for reason in NOT_RUN)
    ]
    for document in DOCUMENTS
    if document != FOLLOWED
}


@pytest.mark.parametrize("document", [document for document, snippets in SNIPPETS.items() if snippets])
def test_snippets_run(document: str, desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after the other, and without what is not said."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", "none")
    if document in MADE and not Path("exported").exists():
        assert main(MADE[document]) == 0
    names = {"__name__": "__main__"}
    for snippet in SNIPPETS[document]:
        exec(compile(snippet, document, "exec"), names)


def test_there_are_snippets() -> None:
    """They are found."""
    assert sum(map(len, SNIPPETS.values())) > 5
