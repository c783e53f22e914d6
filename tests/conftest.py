"""Fixtures for tests that need a user's copy of ARCTIC, which the project cannot ship."""

import os
from pathlib import Path

import pytest

# as the command line does: before anything imports PyTorch
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

from artigrasp.references.arctic import import_arctic


@pytest.fixture(scope="session")
def arctic_release() -> Path:
    """The folder of the ArtiGrasp release's data; without one, the tests that ask for it are skipped."""
    folder = os.environ.get("ARTIGRASP_ARCTIC")
    if not folder:
        pytest.skip("set ARTIGRASP_ARCTIC to the folder of the ArtiGrasp release's data to run this test")
    return Path(folder)


@pytest.fixture(scope="session")
def arctic_folder(arctic_release: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which box and laptop were imported."""
    folder = tmp_path_factory.mktemp("arctic")
    import_arctic(arctic_release, ["box", "laptop"], folder)
    return folder


@pytest.fixture
def arctic_assets(arctic_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Makes the imported box, laptop and MANO hands loadable by name."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(arctic_folder))
    return arctic_folder
