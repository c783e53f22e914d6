"""The error that means the user, not the program, has something to mend."""

import difflib
from collections.abc import Iterable

LONGEST_MESSAGE = 2000
"""Characters of a message; of longer ones the middle is left out."""


class UserError(Exception):
    """Bad usage or bad input; the message is one line that says how to mend it.

    The message names the file, the field, what was expected and what was found, whichever apply. The command line
    prints it without a traceback and exits with code 2. Whatever was found in somebody's file, it stays one line that
    is not too long, and does nothing to a terminal.

    Args:
        message: The message. Breaks of lines become spaces, other characters that cannot be printed escapes.
    """

    def __init__(self, message: str) -> None:
        line = " ".join(message.splitlines())
        line = "".join(each if each.isprintable() else repr(each)[1:-1] for each in line)
        half = LONGEST_MESSAGE // 2
        super().__init__(line if len(line) <= LONGEST_MESSAGE else f"{line[:half]} ... {line[-half:]}")


def nearest(name: str, candidates: Iterable[str]) -> str | None:
    """The candidate most like ``name``, or None if none comes near."""
    by_lower_case = {candidate.lower(): candidate for candidate in candidates}
    found = difflib.get_close_matches(name.lower(), by_lower_case, n=1, cutoff=0.5)
    return by_lower_case[found[0]] if found else None


def unknown(what: str, name: str, candidates: Iterable[str]) -> UserError:
    """The error for a name that is not among the known ones.

    Args:
        what: Kind of thing that was named, such as ``"object"``.
        name: The name that was given.
        candidates: Every name that would have been right.

    Returns:
        An error to raise, which suggests the nearest name or lists them all.
    """
    known = sorted(candidates)
    suggestion = nearest(name, known)
    if suggestion is not None:
        return UserError(f"unknown {what} {name!r}: did you mean {suggestion!r}?")
    return UserError(f"unknown {what} {name!r}: expected one of {', '.join(known) if known else '(there are none)'}")
