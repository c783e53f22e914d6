"""Tests of progress bars and log lines."""

import io
import logging

import pytest
from rich.console import Console

from artigrasp.cli import progress


def console(terminal: bool) -> Console:
    """A console that keeps what it is given."""
    return Console(file=io.StringIO(), force_terminal=terminal, width=120, markup=False, highlight=False)


@pytest.mark.parametrize(
    ("terminal", "hidden", "seen"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_bar_is_shown_only_to_people(terminal: bool, hidden: bool, seen: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bar counts its steps on a terminal, and stays away from files and from output that programs read."""
    screen = console(terminal)
    monkeypatch.setattr(progress, "CONSOLE", screen)
    with progress.progress_bar("Evaluating", hidden=hidden) as show_progress:
        show_progress("reward [1.5]", 3, 4)
        show_progress("done", 4, 4)
    text = screen.file.getvalue()  # type: ignore[attr-defined]
    assert ("Evaluating" in text and "4/4" in text and "done" in text) is seen


def test_log_lines_reach_the_console_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages appear as they are, warnings say that they are one, and asking twice does not double them."""
    screen = console(terminal=False)
    monkeypatch.setattr(progress, "CONSOLE", screen)
    logger = logging.getLogger("test.progress")
    logger.propagate = False
    progress.log_to_console(logger)
    progress.log_to_console(logger)
    logger.debug("hidden")
    logger.info("read %d [links]", 16)
    logger.warning("widened")
    assert screen.file.getvalue() == "read 16 [links]\nwarning: widened\n"  # type: ignore[attr-defined]
