"""Where assets are found and where imports land."""

import os
from pathlib import Path

import pytest

from artigrasp.assets.library import asset_roots, find_asset, find_file, import_root, list_assets, packaged_root
from artigrasp.errors import UserError


def test_users_assets_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``ARTIGRASP_ASSETS`` is searched before what is shipped, which stays visible."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    assert asset_roots() == (tmp_path, packaged_root())
    assert find_asset("hands", "open_left") == packaged_root() / "hands" / "open_left.usda"
    own = tmp_path / "hands" / "open_left.usda"
    own.parent.mkdir()
    own.write_text("")
    (tmp_path / "hands" / ".half.usda").write_text("")
    assert find_asset("hands", "open_left") == own
    assert list_assets("hands") == ["open_left", "open_right"]


def test_several_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are searched in their order, and imports land in the first."""
    folders = [tmp_path / "first", tmp_path / "second"]
    monkeypatch.setenv("ARTIGRASP_ASSETS", os.pathsep.join(map(str, folders)))
    assert import_root() == folders[0]
    assert asset_roots() == (*folders, packaged_root())
    for folder in folders:
        (folder / "hands").mkdir(parents=True)
    (folders[1] / "hands" / "open_left.usda").write_text("")
    assert find_asset("hands", "open_left") == folders[1] / "hands" / "open_left.usda"
    (folders[0] / "hands" / "open_left.usda").write_text("")
    assert find_asset("hands", "open_left") == folders[0] / "hands" / "open_left.usda"


def test_checkout_imports_into_its_ignored_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the variable, imports into a checkout land in the folder that git ignores."""
    monkeypatch.delenv("ARTIGRASP_ASSETS", raising=False)
    repository = packaged_root().parent
    if not (repository / "pyproject.toml").is_file():
        pytest.skip("the package is not installed from a checkout")
    assert import_root() == repository / "assets_usd" / "arctic"
    assert "assets_usd/arctic/" in (repository / ".gitignore").read_text().split()


def test_nothing_there_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that nothing resembles is answered with all that there is."""
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path))
    with pytest.raises(UserError, match="unknown hand 'xyz': expected one of open_left, open_right"):
        find_asset("hands", "xyz")


def test_a_path_that_is_not_there_is_no_unknown_name(tmp_path: Path) -> None:
    """Who names a file that is missing is told so, and who misspells a name is told which are known."""
    for name in ("mine.pt", str(tmp_path / "mine")):
        with pytest.raises(UserError, match=f"^{name}: no such file$"):
            find_file("policies", name)
    with pytest.raises(UserError, match="unknown policy 'liddedbox': did you mean 'lidded-box'"):
        find_file("policies", "liddedbox")
