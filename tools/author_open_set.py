"""Author the open set: of every category the canonical object, a variant to train on and an unseen one.

    python tools/author_open_set.py [FOLDER]

writes `open-CATEGORY.usda`, `open-CATEGORY-1.usda` and `open-CATEGORY-1000.usda` to `assets_usd/objects`. The others
are made on demand: by `artigrasp make-object`, or when an object is named.
"""

import sys
from pathlib import Path

from artigrasp.assets.object import write_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, make_open_object, object_name
from artigrasp.assets.open_set.parameters import FIRST_UNSEEN_SEED

SEEDS = (0, 1, FIRST_UNSEEN_SEED)


def main() -> None:
    """Write the objects."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "assets_usd" / "objects")
    for category in CATEGORIES:
        for seed in SEEDS:
            path = folder / f"{object_name(category, seed)}.usda"
            write_object(make_open_object(category, seed, path))
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
