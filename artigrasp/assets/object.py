"""The objects at hand: load one by name."""

from artigrasp.assets.library import find_asset, list_assets
from artigrasp.assets.object_model import Mesh, ObjectModel, PartModel
from artigrasp.assets.object_usd import read_object, write_object
from artigrasp.assets.open_set.catalogue import parse_name, written_variant

__all__ = ["Mesh", "ObjectModel", "PartModel", "load_object", "read_object", "write_object"]


def load_object(name: str) -> ObjectModel:
    """Load an object from the asset roots; a variant of the open set that is not there is made.

    Raises:
        UserError: there is no such object, or its file is malformed.
    """
    if (variant := parse_name(name)) and name not in list_assets("objects"):
        return read_object(written_variant(*variant))
    return read_object(find_asset("objects", name))
