"""The objects at hand: load one by name."""

from artigrasp.assets.library import find_asset
from artigrasp.assets.object_model import Mesh, ObjectModel, PartModel
from artigrasp.assets.object_usd import read_object, write_object

__all__ = ["Mesh", "ObjectModel", "PartModel", "load_object", "read_object", "write_object"]


def load_object(name: str) -> ObjectModel:
    """Load an object from the asset roots.

    Raises:
        UserError: there is no such object, or its file is malformed.
    """
    return read_object(find_asset("objects", name))
