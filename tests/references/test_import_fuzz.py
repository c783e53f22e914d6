"""What an import made and something damaged: importing again mends it."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artigrasp.references.arctic import import_arctic
from tests.fuzzing import damage, draw_file, examples, note
from tests.readers import uncut
from tests.references import arctic_example as example


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    """Imports leave out what takes seconds."""
    with uncut():
        yield


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of ARCTIC."""
    return example.write_release(tmp_path_factory.mktemp("release"))


@pytest.fixture(scope="module")
def imported(release: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What its import makes."""
    folder = tmp_path_factory.mktemp("imported")
    import_arctic(release, destination=folder)
    return folder


def content(path: Path) -> Any:
    """What is in a file, however its JSON is laid out."""
    return json.loads(path.read_text()) if path.suffix == ".json" else path.read_bytes()


@examples(8)
@given(data=st.data())
def test_damaged_products_are_mended(
    data: st.DataObject, release: Path, imported: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """However a file of an earlier import, or its manifest, is damaged, importing again makes everything as it was."""
    folder = tmp_path_factory.mktemp("mended")
    assets = shutil.copytree(imported, folder / "assets")
    kind = damage(data, draw_file(data, assets), folder / "sign")
    import_arctic(release, destination=assets)
    note(kind, None)
    assert not (folder / "sign").exists()
    for path in imported.rglob("*"):
        if path.is_file():
            assert content(assets / path.relative_to(imported)) == content(path)
    shutil.rmtree(folder)
