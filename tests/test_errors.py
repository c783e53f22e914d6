"""Tests of the user's error and its suggestions."""

import pickle

from artigrasp.errors import LONGEST_MESSAGE, UserError, nearest, unknown


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


def test_a_message_is_one_line_that_can_be_printed() -> None:
    """Whatever a file held: it reaches no terminal as commands, and is not longer than can be read."""
    found = "a\nb\r\n\x1b[2Jc\u2028\udce9é"
    assert str(UserError(f"x.npz: expected a name, found {found}")) == (
        r"x.npz: expected a name, found a b \x1b[2Jc \udce9é"
    )
    long = str(UserError(f"x.npz: {'y' * 10**6}: expected a name"))
    assert len(long) < LONGEST_MESSAGE + 10 and long.startswith("x.npz: y") and long.endswith("y: expected a name")
    copied = pickle.loads(pickle.dumps(UserError("as it was")))  # noqa: S301 -- what processes do with errors
    assert str(copied) == "as it was"
