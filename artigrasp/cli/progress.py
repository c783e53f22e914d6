"""Progress bars and log lines on standard error, one console for both so that they do not overwrite each other."""

import contextlib
import logging
from collections.abc import Iterator
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

CONSOLE = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)


class Advance(Protocol):
    """Moves a progress bar on."""

    def __call__(self, steps: int = 1, *, status: str = "") -> None:
        """Count further steps, and show a few words on how it goes."""
        ...


@contextlib.contextmanager
def progress_bar(description: str, total: int, *, hidden: bool = False) -> Iterator[Advance]:
    """A bar with the time gone and the time left, shown only where somebody can see it.

    Args:
        description: What is going on.
        total: Steps to the end.
        hidden: Whether to show nothing, as for output that a program reads; nothing is shown without a terminal either.

    Yields:
        A function that moves the bar on.
    """
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[status]}", markup=False),
    )
    with Progress(*columns, console=CONSOLE, disable=hidden or not CONSOLE.is_terminal) as bar:
        task = bar.add_task(description, total=total, status="")

        def advance(steps: int = 1, *, status: str = "") -> None:
            bar.update(task, advance=steps, **({"status": status} if status else {}))

        yield advance


class _ConsoleHandler(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        level = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        CONSOLE.print(level + record.getMessage())


def log_to_console(logger: logging.Logger) -> None:
    """Show a logger's messages, from INFO on."""
    logger.setLevel(logging.INFO)
    if not any(isinstance(handler, _ConsoleHandler) for handler in logger.handlers):
        logger.addHandler(_ConsoleHandler())
