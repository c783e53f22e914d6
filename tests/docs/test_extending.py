"""The recipes of `docs/extending.md` work: they are followed in a copy of the sources."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.blocks import read_blocks
from tests.docs.commands import ROOT, read_commands

PAGE = ROOT / "docs" / "extending.md"
PACKAGE = ("kernels", "tasks", "assets_usd")
"""Folders that an installation has inside the package."""


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources with every file that the page adds and every change that it makes."""
    root = tmp_path_factory.mktemp("checkout")
    for name in ("artigrasp", "kernels", "tasks", "tests"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    (root / "docs").mkdir()
    shutil.copy(PAGE, root / "docs")
    (root / "assets_usd").symlink_to(ROOT / "assets_usd")
    for name in PACKAGE:
        (root / "artigrasp" / name).symlink_to(root / name)
    for block in read_blocks(PAGE):
        if block.title:
            (root / block.title).write_text(block.text, encoding="utf-8")
        elif block.language == "diff":
            subprocess.run(["git", "apply", "-"], input=block.text, text=True, cwd=root, check=True)
    return root


def _python(checkout: Path, *words: str) -> None:
    """Run a module of the copy.

    Raises:
        AssertionError: It failed; with what it wrote.
    """
    environment = os.environ | {"PYTHONPATH": str(checkout), "ARTIGRASP_ASSETS": str(checkout / "imported")}
    command = [sys.executable, "-m", *words]
    result = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-4000:]


def test_the_tests_that_it_names_pass(checkout: Path) -> None:
    """What it adds to kernels agrees with what it adds to their references."""
    named = [command.words for command in read_commands(PAGE, prose=False) if command.program == "pytest"]
    assert len(named) == 2
    _python(checkout, "pytest", "-q", "-x", "-p", "no:cacheprovider", *(word for words in named for word in words))


def test_it_can_be_followed(checkout: Path) -> None:
    """Its snippets and its commands run."""
    _python(checkout, "tests.docs.follow", "docs/extending.md")
