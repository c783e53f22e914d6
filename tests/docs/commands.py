"""The commands of the documents: what a reader would type, with variables and loops of the shell written out."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
EIGHT = "box espressomachine ketchup laptop microwave mixer notebook waffleiron"

_ASSIGNMENT = re.compile(r"""([A-Z_]+)=("[^"]*"|\S*)""")
_LOOP = re.compile(r"for (\w+) in ([^;]+); do (.*?); done")
_OPTIONAL = re.compile(r"\s*\[[^\]]*\]|(?<=\w)\.\.\.")
"""What of a synopsis may be left out."""
_SYNOPSIS = re.compile(r"\b(VERB|PROTOCOL)\b|\[\w+\\?\||…|\s\.\.\.")
"""What stands for words of the reader's own."""


@dataclass(frozen=True)
class Command:
    """One command of a document.

    Attributes:
        document: Where it stands, from the root of the project.
        environment: Variables that it is given.
        program: ``artigrasp``, ``tools.NAME`` for a program of the project's tools, or else the first word.
        words: What follows the program.
    """

    document: str
    environment: tuple[tuple[str, str], ...]
    program: str
    words: tuple[str, ...]

    def __str__(self) -> str:
        return shlex.join([*(f"{name}={value}" for name, value in self.environment), self.program, *self.words])


def read_commands(document: Path, *, fenced: bool = True, prose: bool = True) -> list[Command]:
    """The commands of a document: lines of its blocks, what begins like one in its prose, or both."""
    text = document.read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL) if fenced else []
    outside = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    program = r"(?:[A-Z_]+=\S+ )*(?:artigrasp\s+[\w-]+\s|python (?:-m )?tools[./][\w.]+)"
    indented = re.findall(rf"^    ({program}(?:[^\\\n]|\\\n)*)", outside, flags=re.MULTILINE)
    inline = [" ".join(code.split()) for code in re.findall(rf"`({program}[^`]*)`", outside)]
    lines = [line.strip() for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    if prose:
        lines += [line.replace("\\\n", " ").replace("=... ", "= ") for line in indented + inline]
    variables = {"OBJECTS": EIGHT}
    found = []
    for line in lines:
        if loop := _LOOP.search(line):
            variables[loop[1]], line = loop[2].split()[0], loop[3]
        line = re.sub(r"\$(\w+)", lambda match: variables.get(match[1], match[0]), line)
        if assignment := _ASSIGNMENT.fullmatch(line):
            variables[assignment[1]] = assignment[2].strip('"')
        elif not _SYNOPSIS.search(line) and (command := _command(document, _OPTIONAL.sub("", line))):
            found.append(command)
    return found


def _command(document: Path, line: str) -> Command | None:
    """The command of a line, or None if there is none in it."""
    words = shlex.split(line, comments=True)
    environment = []
    while words and (assignment := _ASSIGNMENT.fullmatch(words[0])):
        environment += [(assignment[1], assignment[2])] if assignment[2] else []
        words.pop(0)
    if words and words[0] == "time":
        words.pop(0)
    if not words or words[0] == "export":
        return None
    if words[0] == "python" and (tool := re.fullmatch(r"tools[./](\w+?)(\.py)?", words[2 if words[1] == "-m" else 1])):
        words = [f"tools.{tool[1]}", *words[3 if words[1] == "-m" else 2 :]]
    program, *rest = words
    program = program.removeprefix(".venv/bin/")
    return Command(str(document.relative_to(ROOT)), tuple(environment), program, tuple(rest))
