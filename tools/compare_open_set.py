"""Compare sizes and masses of the open set with ARCTIC's objects of the same categories.

    ARTIGRASP_ASSETS=... python tools/compare_open_set.py

prints the table in `docs/objects.md`: sides of the closed object, longest first, masses of base and articulated part,
and how far the hinge opens; the range of each over the canonical object and 200 variants.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from artigrasp.assets.library import list_assets
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, make_open_object

ARCTIC_NAMES = {"espresso-machine": "espressomachine", "ketchup-bottle": "ketchup", "waffle-iron": "waffleiron"}
"""Where they differ from ours."""
VARIANTS = 200


def figures(model: ObjectModel) -> list[float]:
    """Three sides [cm], longest first, two masses [kg] and the hinge's range [deg]."""
    sides = sorted(100 * np.ptp(model.vertices_in_base(0.0), axis=0), reverse=True)
    return [*map(float, sides), *(part.mass for part in model.parts), float(np.degrees(model.hinge_upper))]


def cells(values: Sequence[str]) -> str:
    """Sides together, then the others."""
    return " | ".join([" × ".join(values[:3]), *values[3:]])


def main() -> None:
    """Print the table."""
    print("| category | | sides cm | base kg | articulated kg | opens to ° |\n| --- | --- | --- | --- | --- | --- |")
    for category in CATEGORIES:
        models = [make_open_object(category, seed, Path("unused.usda")) for seed in range(VARIANTS + 1)]
        found = np.array([figures(model) for model in models])
        print(f"| {category} | canonical | {cells([f'{value:.3g}' for value in found[0]])} |")
        ends = zip(found.min(axis=0), found.max(axis=0), strict=True)
        print(f"| | variants | {cells([f'{low:.3g}–{high:.3g}' for low, high in ends])} |")
        if (name := ARCTIC_NAMES.get(category, category)) in list_assets("objects"):
            print(f"| | ARCTIC | {cells([f'{value:.3g}' for value in figures(load_object(name))])} |")


if __name__ == "__main__":
    main()
