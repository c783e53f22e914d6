"""Results on standard output, and nothing else there: other programs read it."""

import contextlib
import json
import sys
from collections.abc import Iterator, Sequence
from typing import Any, TextIO

_results: TextIO | None = None


@contextlib.contextmanager
def results_only() -> Iterator[None]:
    """While this lasts, what libraries print goes to standard error; what this module shows, to standard output."""
    global _results
    _results = sys.stdout
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
        _results.flush()
    finally:
        _results = None


def show(text: str = "") -> None:
    """Print a line of the result, at once: a verb may go on for long after it."""
    print(text, file=_results or sys.stdout, flush=True)


def show_columns(rows: Sequence[Sequence[str]]) -> None:
    """Print rows of text with their columns aligned."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        show("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())


def show_json(value: Any) -> None:
    """Print a result as JSON; it must hold neither NaN nor infinity, which JSON does not know."""
    show(json.dumps(value, indent=2, allow_nan=False))
