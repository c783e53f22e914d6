"""Assets and tasks for the verbs that simulate."""

from dataclasses import replace
from pathlib import Path

import pytest

from artigrasp.config import TaskConfig
from artigrasp.references.reference import save_references
from artigrasp.tasks import TASKS
from tests.example_references import box_references
from tests.training.examples import small_paper, small_synergy


@pytest.fixture
def assets(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's asset folder with references of the lidded box that were made by hand."""
    folder = tmp_path_factory.mktemp("assets")
    save_references(folder / "references" / "lidded-box.npz", box_references(test_count=2))
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(folder))
    return folder


@pytest.fixture
def work(tmp_path: Path, assets: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The empty folder that the user is in, with two quick tasks: ``quick``, and ``other`` with the paper's action."""
    monkeypatch.chdir(tmp_path)
    for name, task in (("quick", small_synergy(interval=20)), ("other", small_paper())):
        monkeypatch.setitem(TASKS, name, quick_task(name, task))
    return tmp_path


def quick_task(name: str, task: TaskConfig) -> TaskConfig:
    """A small task under a name of its own."""
    return replace(task, name=name, description="For tests.", iterations=2)
