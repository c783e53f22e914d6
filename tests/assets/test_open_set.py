"""The open set: names, seeds, what is shipped, and that the parts of every object leave each other room."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artigrasp.assets.check import check_asset
from artigrasp.assets.library import packaged_root
from artigrasp.assets.object import load_object, read_object, write_object
from artigrasp.assets.open_set.catalogue import CATEGORIES, make_open_object, object_name, parse_name
from artigrasp.assets.open_set.hinged import make_part
from artigrasp.assets.open_set.parameters import FIRST_UNSEEN_SEED, Range, split_of, vary
from artigrasp.errors import UserError
from tests.assets.clearance import deepest_overlap

SHIPPED_SEEDS = (0, 1, FIRST_UNSEEN_SEED)


@pytest.mark.parametrize("category", CATEGORIES)
def test_shipped_objects_are_what_the_generator_makes(category: str) -> None:
    """``tools/author_open_set.py`` writes the shipped files, which are small."""
    for seed in SHIPPED_SEEDS:
        path = packaged_root() / "objects" / f"{object_name(category, seed)}.usda"
        assert path.stat().st_size < 150_000
        shipped, made = read_object(path), make_open_object(category, seed, path)
        assert shipped.name == made.name == path.stem
        assert shipped.hinge_upper == pytest.approx(made.hinge_upper, rel=1e-6)
        for one, other in zip(shipped.parts, made.parts, strict=True):
            for name in ("mass", "com", "inertia", "vertices", "faces", "colours"):
                np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("category", CATEGORIES)
def test_parts_leave_each_other_room(category: str) -> None:
    """No piece of the one part is within the other anywhere in the hinge's range, but for half a millimetre."""
    for seed in (0, 2, FIRST_UNSEEN_SEED + 1):
        model = make_open_object(category, seed, Path("unused.usda"))
        assert deepest_overlap(model, np.linspace(0, model.hinge_upper, 13)) < 5e-4


@pytest.mark.parametrize("category", CATEGORIES)
def test_every_corner_of_the_ranges_makes_a_sound_object(category: str, tmp_path: Path) -> None:
    """With all sizes least, and all most, the object passes ``check-asset`` and leaves its parts room."""
    kind: Any = CATEGORIES[category]
    values = {field.name: field.metadata["values"] for field in fields(kind)}
    ranges = {name: each for name, each in values.items() if isinstance(each, Range)}
    plans = [kind(**{name: getattr(each, end) for name, each in ranges.items()}) for end in ("low", "high")]
    for index, plan in enumerate(plans):
        blueprint = plan.blueprint()
        path = tmp_path / f"{index}.usda"
        made = make_open_object(category, 0, path)
        parts = make_part(blueprint.base, blueprint.base_mass), make_part(blueprint.articulated, 0.1)
        changed = type(made)(
            **{field.name: getattr(made, field.name) for field in fields(made)}
            | {"parts": parts, "hinge_origin": np.array(blueprint.hinge.origin), "hinge_upper": blueprint.hinge.upper}
        )
        write_object(changed)
        assert check_asset(path).findings == ()
        assert deepest_overlap(changed, np.linspace(0, changed.hinge_upper, 7)) < 5e-4


@pytest.mark.parametrize("category", CATEGORIES)
def test_canonical_values_are_within_their_ranges(category: str) -> None:
    """Every number of a canonical object could be that of a variant, and every variant's is within its range."""
    for plan in (vary(CATEGORIES[category], seed) for seed in range(20)):
        for field in fields(plan):  # type: ignore[arg-type]
            value, values = getattr(plan, field.name), field.metadata["values"]
            if isinstance(values, Range):
                assert values.low <= value <= values.high and values.source
            else:
                assert value in values


def test_a_seed_makes_the_same_object_again_and_another_seed_another() -> None:
    """Variants are a function of their seed."""
    first, again, other = (make_open_object("laptop", seed, Path("unused.usda")) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.parts[0].vertices, again.parts[0].vertices)
    assert first.parts[0].mass == again.parts[0].mass != other.parts[0].mass


def test_names_say_category_and_seed() -> None:
    """Names of the open set are told from others, among them those of ARCTIC's objects."""
    for category in CATEGORIES:
        for seed in (0, 3, 1000):
            assert parse_name(object_name(category, seed)) == (category, seed)
    for name in ("laptop", "open-", "open-laptop-0", "open-laptop-03", "open-piano", "lidded-box"):
        assert parse_name(name) is None
    assert (split_of(1), split_of(999), split_of(1000)) == ("train", "train", "unseen")


def test_variants_are_made_when_they_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An object that is not shipped is loaded by its name all the same; a wrong category is answered with a name."""
    monkeypatch.setenv("ARTIGRASP_CACHE", str(tmp_path))
    model = load_object("open-box-41")
    assert model.path.is_file() and tmp_path in model.path.parents and model.name == "open-box-41"
    with pytest.raises(UserError, match="did you mean 'open-laptop'"):
        load_object("open-labtop")
