"""Tests of the panel's pictures and plots, and of its jobs."""

import math
import queue
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable

import numpy as np
import pytest

from artigrasp.errors import UserError
from artigrasp.viewer.gauge import metrics_html, status_html
from artigrasp.viewer.jobs import Jobs
from artigrasp.viewer.plots import now_mark
from artigrasp.viewer.saving import file_stem


def test_status_is_well_formed() -> None:
    """Whatever names and messages hold, the status is well-formed; it tells angle, target, phase and time."""
    text = status_html(title="<b> & co", phase="put <down>", time=1.234, angle=0.5, target=1.0, note="a < b")
    words = "".join(ElementTree.fromstring(text).itertext())
    for word in ("<b> & co", "put <down>", "1.23 s", "29°", "57°", "a < b"):
        assert word in words
    ElementTree.fromstring(metrics_html({"a_<b": 1.0}))


@pytest.mark.parametrize("angle", [-0.1, 0.0, math.pi, 9.0])
def test_gauge_takes_any_angle(angle: float) -> None:
    """An angle beyond the gauge is drawn at its end."""
    text = status_html(title="", phase="x", time=0.0, angle=angle, target=None)
    assert "nan" not in text
    ElementTree.fromstring(text)


def test_playhead_in_plots() -> None:
    """The mark stays within what the curves show, and stands out at the playhead alone, even at the very end."""
    times, columns = np.linspace(0, 1, 11), [np.linspace(-1, 1, 11), np.zeros(11)]
    for time, row in ((0.0, 0), (0.5, 5), (2.0, 10)):
        mark = now_mark(times, columns, time)
        assert np.flatnonzero(mark > -1).tolist() == [row] and mark[row] == 1


def test_file_names() -> None:
    """A title becomes a name that every system takes."""
    assert file_stem("a/b: c.npz") == "a-b--c-npz"
    assert file_stem("..") == "motion"


class _Thread:
    """Stands for the viewer's thread."""

    def __init__(self) -> None:
        self.calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self.jobs = Jobs(self.calls.put)
        self.heard: list[str] = []

    def start(self, work: Callable[..., str]) -> None:
        self.jobs.start("testing", work, self.heard.append, lambda message: self.heard.append(f"error: {message}"))

    def finish(self) -> None:
        self.calls.get(timeout=5.0)()


def test_job_tells_its_result() -> None:
    """A job's progress can be seen, its result arrives in the viewer's thread, and there is one job at a time."""
    thread, go = _Thread(), threading.Event()

    def work(progress: Callable[[int, int], None]) -> str:
        progress(1, 2)
        go.wait(5.0)
        return "done"

    thread.start(work)
    thread.start(work)
    assert thread.heard == ["error: wait until this is done: testing"]
    go.set()
    thread.finish()
    assert thread.heard[1:] == ["done"] and not thread.jobs.is_busy


@pytest.mark.parametrize(
    ("error", "expected"), [(UserError("no box"), "error: no box"), (ValueError("x"), "error: testing failed: x")]
)
def test_job_that_fails(error: Exception, expected: str) -> None:
    """What goes wrong is told in one line, and the next job can start."""
    thread = _Thread()

    def work(progress: Callable[[int, int], None]) -> str:
        raise error

    thread.start(work)
    thread.finish()
    assert thread.heard == [expected] and not thread.jobs.is_busy


def test_job_that_is_cancelled() -> None:
    """A job ends at its next step after somebody gave it up."""
    thread, begun = _Thread(), threading.Event()

    def work(progress: Callable[[int, int], None]) -> str:
        while True:
            progress(1, 2)
            begun.set()

    thread.start(work)
    assert begun.wait(5.0)
    thread.jobs.cancel()
    thread.finish()
    assert thread.heard == ["error: testing: cancelled"]
