"""Tests of the user's error and its suggestions."""

from artigrasp.errors import UserError, nearest, unknown


def test_nearest_finds_a_misspelt_name() -> None:
    """A typing slip, also in case, leads to the name that was meant; a far name leads nowhere."""
    assert nearest("lapotp", ["box", "laptop"]) == "laptop"
    assert nearest("BOX", ["box", "laptop"]) == "box"
    assert nearest("zebra", ["box", "laptop"]) is None


def test_unknown_suggests_or_lists() -> None:
    """The error names the nearest candidate, else all of them."""
    error = unknown("object", "bxo", ["laptop", "box"])
    assert isinstance(error, UserError)
    assert str(error) == "unknown object 'bxo': did you mean 'box'?"
    assert str(unknown("object", "zebra", ["laptop", "box"])) == "unknown object 'zebra': expected one of box, laptop"
    assert str(unknown("policy", "zebra", [])) == "unknown policy 'zebra': expected one of (there are none)"
