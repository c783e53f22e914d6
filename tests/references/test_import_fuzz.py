"""The import of damaged data: it ends well or in one line, and leaves nothing that cannot be read."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artigrasp.assets.fidelity import Fidelity
from artigrasp.assets.hand import read_hand
from artigrasp.assets.object import read_object
from artigrasp.errors import UserError
from artigrasp.references import arctic
from artigrasp.references.arctic import import_arctic
from artigrasp.references.reference import read_references
from tests.fuzzing import damage, examples, note
from tests.references import arctic_example as example

pytestmark = pytest.mark.usefixtures("quick_skins")


@pytest.fixture(scope="module", autouse=True)
def uncut() -> Iterator[None]:
    """Every mesh is its own only piece, unmeasured."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arctic, "cut_meshes", lambda meshes, processes, progress: None)
        patch.setattr(arctic, "convex_pieces", lambda mesh: (mesh,))
        patch.setattr(arctic, "measure_fidelity", lambda mesh, pieces: Fidelity(1, 0, 1.0, 0.0, 0.0, 0.0, 0.0))
        yield


@pytest.fixture(scope="module")
def copies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A copy of ARCTIC in every layout."""
    root = tmp_path_factory.mktemp("copies")
    both = example.write_release(root / "both", labels=False)
    example.write_labelled_frames(both / "labelled_frames.npz")
    return {
        "release": example.write_release(root / "release"),
        "both": both,
        "download": example.write_download(root / "download", objects=("box",), parted=False),
    }


@pytest.fixture(scope="module")
def imported(copies: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What an import of the release makes."""
    folder = tmp_path_factory.mktemp("imported")
    import_arctic(copies["release"], destination=folder)
    return folder


@examples(40)
@given(data=st.data())
def test_damaged_copies_end_in_one_line(
    data: st.DataObject, copies: dict[str, Path], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """However one file is damaged, the import ends well or with one line, and every file that it leaves can be read."""
    folder = tmp_path_factory.mktemp("damaged")
    root = shutil.copytree(copies[data.draw(st.sampled_from(sorted(copies)))], folder / "copy")
    kind = damage(data, draw_file(data, root), folder / "sign")
    try:
        import_arctic(root, destination=folder / "assets")
        note(kind, None)
    except UserError as error:
        note(kind, error)
    assert not (folder / "sign").exists()
    check_files(folder / "assets")
    shutil.rmtree(folder)


@examples(8)
@given(data=st.data())
def test_damaged_products_are_mended(
    data: st.DataObject, copies: dict[str, Path], imported: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """However a file of an earlier import, or its manifest, is damaged, importing again makes everything as it was."""
    folder = tmp_path_factory.mktemp("mended")
    assets = shutil.copytree(imported, folder / "assets")
    kind = damage(data, draw_file(data, assets), folder / "sign")
    import_arctic(copies["release"], destination=assets)
    note(kind, None)
    assert not (folder / "sign").exists()
    for path in imported.rglob("*"):
        if path.is_file():
            assert (assets / path.relative_to(imported)).read_bytes() == path.read_bytes()
    shutil.rmtree(folder)


def draw_file(data: st.DataObject, root: Path) -> Path:
    """One of the files below a folder."""
    return data.draw(st.sampled_from(sorted(path for path in root.rglob("*") if path.is_file())))


def check_files(assets: Path) -> None:
    """Read every file that an import left, in its own way."""
    left = [path for path in assets.rglob("*") if path.is_file() and path.name != "manifest.json"]
    for path in left:
        name = path.relative_to(assets).as_posix()
        if name.startswith("objects"):
            model = read_object(path)
            assert all(0 < part.mass < 1e6 for part in model.parts)
        elif name.endswith("mean_pose.npz"):
            assert np.load(path)["left"].shape == (45,)
        elif name.startswith("hands"):
            assert np.isfinite(read_hand(path).link_mass).all()
        else:
            assert name == "references/box.npz" and len(read_references(path)) > 0
