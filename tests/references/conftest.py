"""What tests of the import share."""

from collections.abc import Iterator
from functools import cache

import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.references import arctic


@pytest.fixture(scope="module")
def quick_skins() -> Iterator[None]:
    """Imported hands get the open hand's skin: drawing theirs, which has tests of its own, takes seconds each."""
    skin = cache(lambda side: load_hand("open", side).skin)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arctic, "draw_skin", lambda hand: skin(hand.side))
        yield
