"""Work that takes long, one piece at a time in the background of the viewer."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from artigrasp.errors import UserError

logger = logging.getLogger(__name__)

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Told how many steps are done and how many there are in all."""


class Cancelled(Exception):
    """Somebody gave up waiting."""


@dataclass
class JobState:
    """How the work goes.

    Attributes:
        name: What is being done, in words; empty if nothing is.
        done: Steps done.
        total: Steps in all, 0 while that is not known.
    """

    name: str = ""
    done: int = 0
    total: int = 0


class Jobs:
    """Runs one job at a time; what happens is told by calls of ``post``, which hands them to the viewer's thread."""

    def __init__(self, post: Callable[[Callable[[], None]], None]) -> None:
        """Hand what follows from a job to the viewer's thread by ``post``."""
        self._post = post
        self._cancel = threading.Event()
        self._thread: threading.Thread | None = None
        self.state = JobState()

    @property
    def is_busy(self) -> bool:
        """Whether one is running."""
        return bool(self.state.name)

    def start(
        self,
        name: str,
        work: Callable[[Progress], T],
        on_done: Callable[[T], None],
        on_error: Callable[[str], None],
    ) -> None:
        """Begin a job; to be called in the viewer's thread.

        Args:
            name: What is being done, in words.
            work: Does it, in a thread of its own, and tells how far it is.
            on_done: Called in the viewer's thread with the result.
            on_error: Called there with what went wrong, in one line.
        """
        if self.is_busy:
            on_error(f"wait until this is done: {self.state.name}")
            return
        self.state = JobState(name)
        self._cancel.clear()

        def run() -> None:
            try:
                result = work(self._progress)
            except Cancelled:
                self._finish(lambda: on_error(f"{name}: cancelled"))
            except UserError as error:
                message = str(error)
                self._finish(lambda: on_error(message))
            except Exception as error:
                # a job that fails must not end the viewer
                logger.exception("%s failed", name)
                message = f"{name} failed: {error}"
                self._finish(lambda: on_error(message))
            else:
                self._finish(lambda: on_done(result))

        self._thread = threading.Thread(target=run, name=name, daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Give up the running job at its next step."""
        self._cancel.set()

    def close(self) -> None:
        """Give it up and wait a little for it to end."""
        self.cancel()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def _progress(self, done: int, total: int) -> None:
        if self._cancel.is_set():
            raise Cancelled
        self.state = JobState(self.state.name, done, total)

    def _finish(self, then: Callable[[], None]) -> None:
        def finish() -> None:
            self.state = JobState()
            then()

        self._post(finish)
