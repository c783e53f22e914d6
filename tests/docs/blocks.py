"""The code blocks of the documents: Python, changes of files, and commands."""

import re
from dataclasses import dataclass
from pathlib import Path

_FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```', flags=re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """One fenced block.

    Attributes:
        language: Such as ``python``, ``sh`` or ``diff``.
        title: The file that it is the content of, or nothing.
        text: What is in it.
    """

    language: str
    title: str
    text: str


def read_blocks(document: Path) -> list[Block]:
    """The fenced blocks of a document that name their language, in order."""
    return [Block(*(part or "" for part in found)) for found in _FENCE.findall(document.read_text(encoding="utf-8"))]
