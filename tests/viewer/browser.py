"""A real browser for the tests: Chromium, named by ``ARTIGRASP_CHROMIUM`` or found on the path."""

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
)
"""Draws on the processor, and asks the network for nothing."""
PATIENCE = 150.0
"""How long something may take on a machine that does other things, too [s]."""


def find_chromium() -> str:
    """The program; a test that needs it is skipped where there is none."""
    named = os.environ.get("ARTIGRASP_CHROMIUM")
    found = named or next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("install Chromium or name it in ARTIGRASP_CHROMIUM to run this test in a browser")
    return found


@contextmanager
def open_browser() -> Iterator[Browser]:
    """Start Chromium without a window."""
    path = find_chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS.split(), timeout=1000 * PATIENCE)
        try:
            yield browser
        finally:
            browser.close()


def wait_until(page: Page, condition: Callable[[], object], what: str) -> None:
    """Wait until something holds, letting the page go on meanwhile."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"still not: {what}"
        page.wait_for_timeout(50)
