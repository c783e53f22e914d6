"""Where assets are looked for: the user's own first, then those that come with the package."""

import os
from pathlib import Path
from typing import Literal

import platformdirs

import artigrasp.assets_usd
from artigrasp.errors import UserError, unknown

AssetKind = Literal["hands", "objects", "references", "policies", "stories"]
SUFFIX: dict[AssetKind, str] = {
    "hands": ".usda",
    "objects": ".usda",
    "references": ".npz",
    "policies": ".pt",
    "stories": ".yaml",
}
_SINGULAR: dict[AssetKind, str] = {
    "hands": "hand",
    "objects": "object",
    "references": "reference",
    "policies": "policy",
    "stories": "story",
}


def packaged_root() -> Path:
    """The folder of the assets that come with the package."""
    return Path(next(iter(artigrasp.assets_usd.__path__)))


def import_root() -> Path:
    """The folder that imported data lands in.

    The first one of ``$ARTIGRASP_ASSETS`` where it is set; else ``assets_usd/arctic`` of a source checkout, which git
    ignores; else the user's data folder.
    """
    if chosen := _chosen_roots():
        return chosen[0]
    packaged = packaged_root()
    if (packaged.parent / "pyproject.toml").is_file():
        return packaged / "arctic"
    return platformdirs.user_data_path("artigrasp")


def asset_roots() -> tuple[Path, ...]:
    """The folders that hold a folder of each kind of asset, such as ``hands/``, the first to be searched first.

    ``$ARTIGRASP_ASSETS`` may name several, separated as in ``$PATH``.
    """
    return (*(_chosen_roots() or (import_root(),)), packaged_root())


def _chosen_roots() -> tuple[Path, ...]:
    names = os.environ.get("ARTIGRASP_ASSETS", "").split(os.pathsep)
    return tuple(Path(name).expanduser().resolve() for name in names if name)


def list_assets(kind: AssetKind) -> list[str]:
    """The names of all assets of a kind, sorted."""
    return sorted({path.stem for root in asset_roots() for path in (root / kind).glob(f"[!.]*{SUFFIX[kind]}")})


def find_asset(kind: AssetKind, name: str) -> Path:
    """The file of an asset.

    Raises:
        UserError: there is none; suggests names that come near.
    """
    names = list_assets(kind)
    if name not in names:
        raise unknown(_SINGULAR[kind], name, names)
    return next(path for root in asset_roots() if (path := root / kind / f"{name}{SUFFIX[kind]}").is_file())


def asset_files(kind: AssetKind) -> dict[str, Path]:
    """The files of all assets of a kind by name; of two with one name that in the first root."""
    return {name: find_asset(kind, name) for name in list_assets(kind)}


def find_file(kind: AssetKind, name: str) -> Path:
    """The file of an asset, given by its path or by its name.

    Raises:
        UserError: There is neither; suggests the nearest name, unless it was a path.
    """
    path = Path(name)
    if path.is_file():
        return path
    if path.suffix == SUFFIX[kind] or len(path.parts) > 1:
        raise UserError(f"{name}: no such file")
    return find_asset(kind, name)
