"""The import of damaged data: it ends well or in one line, and leaves nothing that cannot be read."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from artigrasp.assets.fidelity import Fidelity
from artigrasp.assets.hand import read_hand
from artigrasp.assets.object import read_object
from artigrasp.errors import UserError
from artigrasp.references import arctic
from artigrasp.references.arctic import import_arctic
from artigrasp.references.reference import read_references
from tests.references import arctic_example as example


def damage(data: st.DataObject, root: Path) -> None:
    """Damage one file of a copy: cut it off, change bytes, replace numbers or the whole."""
    paths = sorted(path for path in root.rglob("*") if path.is_file())
    path = data.draw(st.sampled_from(paths))
    content = path.read_bytes()
    kind = data.draw(st.sampled_from(["missing", "cut", "bytes", "array", "text", "made up"]))
    if kind == "missing":
        path.unlink()
    elif kind == "cut":
        path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    elif kind == "bytes":
        at = data.draw(st.integers(0, len(content) - 1))
        path.write_bytes(content[:at] + data.draw(st.binary(min_size=1, max_size=8)) + content[at + 1 :])
    elif kind == "array" and path.suffix in (".npy", ".npz"):
        damage_array(data, path)
    elif kind == "text" and path.suffix in (".urdf", ".obj", ".txt", ".json"):
        words = content.decode().split(" ")
        at = data.draw(st.integers(0, len(words) - 1))
        words[at] = data.draw(st.sampled_from(["nan", "inf", "-1", "1e300", "0", "", "1e-30", "99999", "é", '"']))
        path.write_text(" ".join(words))
    else:
        path.write_bytes(data.draw(st.binary(max_size=50)))


def damage_array(data: st.DataObject, path: Path) -> None:
    """Replace a number by one that cannot be, or an array by one of another shape or type."""
    loaded: Any = np.load(path, allow_pickle=True)
    arrays = dict(loaded) if path.suffix == ".npz" else {"only": loaded}
    name = data.draw(st.sampled_from(sorted(arrays)))
    array = arrays[name]
    if array.dtype == object:
        target = array.item() if array.ndim == 0 else array[data.draw(st.integers(0, len(array) - 1))]
        if "left" in target:
            target = target[data.draw(st.sampled_from(["left", "right"]))]
        key = data.draw(st.sampled_from(sorted(target)))
        target[key] = data.draw(st.sampled_from([None, "s1", -1, 10**9, 2.5, np.nan, [], np.zeros((3, 3)), {}]))
    else:
        extremes: list[Any] = [np.nan, np.inf, 1e300, -1, 0, 10**9] if array.dtype.kind in "fiu" else ["", "../x", "s5"]
        choice = data.draw(st.sampled_from(["value", "flat", "empty", "complex", "object"]))
        if choice == "value" and array.size:
            array = array.astype(float) if array.dtype.kind in "fiu" else array.astype("U10")
            array.flat[data.draw(st.integers(0, array.size - 1))] = data.draw(st.sampled_from(extremes))
        shapes = {"flat": array.ravel(), "empty": array[:0], "value": array}
        arrays[name] = (
            shapes[choice] if choice in shapes else array.astype(choice if array.dtype.kind != "U" else "S10")
        )
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        np.save(path, arrays["only"], allow_pickle=True)


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


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_damaged_copies_end_in_one_line(
    data: st.DataObject, copies: dict[str, Path], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """However one file is damaged, the import ends well or with one line, and every file that it leaves can be read."""
    folder = tmp_path_factory.mktemp("damaged")
    root = shutil.copytree(copies[data.draw(st.sampled_from(sorted(copies)))], folder / "copy")
    damage(data, root)
    try:
        import_arctic(root, destination=folder / "assets")
    except UserError as error:
        assert "\n" not in str(error)
    left = [path for path in (folder / "assets").rglob("*") if path.is_file() and path.name != "manifest.json"]
    for path in left:
        name = path.relative_to(folder / "assets").as_posix()
        if name.startswith("objects"):
            model = read_object(path)
            assert all(0 < part.mass < 1e6 for part in model.parts)
        elif name.endswith("mean_pose.npz"):
            assert np.load(path)["left"].shape == (45,)
        elif name.startswith("hands"):
            assert np.isfinite(read_hand(path).link_mass).all()
        else:
            assert name == "references/box.npz" and len(read_references(path)) > 0
    shutil.rmtree(folder)
