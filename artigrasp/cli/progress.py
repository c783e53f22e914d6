"""Progress bars and log lines on standard error, one console for both so that they do not overwrite each other."""

import contextlib
import logging
from collections.abc import Callable, Iterator

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

CONSOLE = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)


Progress = Callable[[str, int, int], None]
"""Told what is being done, how many steps are done and how many there are in all."""


@contextlib.contextmanager
def progress_bar(description: str, *, hidden: bool = False) -> Iterator[Progress]:
    """A bar with the time gone and the time left, shown only where somebody can see it.

    Args:
        description: What is going on.
        hidden: Whether to show nothing, as for output that a program reads; nothing is shown without a terminal either.

    Yields:
        What library functions take as their ``progress``.
    """
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[status]}", markup=False),
    )
    with rich.progress.Progress(*columns, console=CONSOLE, disable=hidden or not CONSOLE.is_terminal) as bar:
        task = bar.add_task(description, total=None, status="")

        def show_progress(status: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, status=status)

        yield show_progress


class _ConsoleHandler(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        level = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        CONSOLE.print(level + record.getMessage())


def log_to_console(logger: logging.Logger) -> None:
    """Show a logger's messages, from INFO on."""
    logger.setLevel(logging.INFO)
    if not any(isinstance(handler, _ConsoleHandler) for handler in logger.handlers):
        logger.addHandler(_ConsoleHandler())
