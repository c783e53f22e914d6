"""The viewer in a real browser: what the page shows is what the server knows, and what people do reaches it."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("playwright.sync_api", reason="install the extra dev to run these tests in a browser")

from playwright.sync_api import Browser, Page
from pxr import Usd

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.motion.file import load_motion
from artigrasp.tasks import get_task
from artigrasp.viewer.appearance import Appearance
from artigrasp.viewer.live_subject import LiveSubject
from artigrasp.viewer.motion_subject import MotionSubject
from artigrasp.viewer.pilot import SteadyPilot
from artigrasp.viewer.reference_subject import ReferenceSubject
from artigrasp.viewer.server import Server
from artigrasp.viewer.viewer import Viewer
from tests.motion.example import example_motion
from tests.viewer.browser import PATIENCE, open_browser, wait_until

SIZE = {"width": 480, "height": 560}
COARSE = Appearance(fine=False)
"""Chromium draws on the processor here."""
SIMULATOR = SimulatorConfig(threads=1)
MOTION = example_motion(sample_count=301)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser for all tests."""
    with open_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    """A viewer that serves a motion of three seconds and references."""
    server = Server(port=0)
    task = get_task("right-fixed")
    live = LiveSubject(
        "live",
        SteadyPilot(pd_ik_controller(task), "pd-ik"),
        ["lidded-box"],
        reward_terms=("keypoint", "contact"),
        world_count=2,
        simulator=SIMULATOR,
    )
    subjects = {
        "motion": MotionSubject([("motion", MOTION)]),
        "references": ReferenceSubject(["lidded-box"]),
        "live": live,
    }
    viewer = Viewer(subjects, server, objects=["lidded-box"], policies={}, simulator=SIMULATOR, appearance=COARSE)
    viewer.playback.playing = False
    thread = threading.Thread(target=viewer.run)
    thread.start()
    yield viewer
    viewer.stop()
    thread.join(PATIENCE)
    server.stop()
    assert not thread.is_alive()


@pytest.fixture(scope="module")
def page(browser: Browser, viewer: Viewer) -> Page:
    """A page on which the motion is shown; whatever it reports as an error fails the test that comes next."""
    page = open_page(browser, viewer)
    wait_until(page, lambda: len(viewer._display._figures) == 1, "the motion is drawn")
    return page


@pytest.fixture(autouse=True)
def no_errors(page: Page) -> Iterator[None]:
    """Nothing may go wrong in the page."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield
    assert not errors


def open_page(browser: Browser, viewer: Viewer) -> Page:
    """Open the viewer and wait for its panel."""
    page = browser.new_page(viewport=SIZE)
    page.set_default_timeout(1000 * PATIENCE)
    page.goto(viewer.url)
    page.get_by_text("ArtiGrasp").wait_for()
    page.locator(".phase").wait_for()
    return page


def shown_time(page: Page) -> float:
    """The time of the sample that the page shows [s]."""
    return float(page.locator(".sample-time").inner_text().removesuffix(" s"))


def scrub(page: Page, time: float) -> None:
    """Put the playhead at a time [s] by the box beside the timeline."""
    fill(page, "Time [s]", time)


def fill(page: Page, label: str, value: float) -> None:
    """Put a number into the box beside a slider."""
    slider = page.locator("label", has_text=label).get_attribute("for")
    page.locator(f"[id='{slider}']").locator("xpath=..").locator("input[inputmode]").fill(str(value))


def test_scrub(page: Page, viewer: Viewer) -> None:
    """Where people put the playhead, the server shows the sample of that time, and so does the page."""
    for time in (1.5, 0.5):
        scrub(page, time)
        wait_until(page, lambda time=time: viewer.playback.time == time, "the playhead is there")
        wait_until(page, lambda time=time: shown_time(page) == time, "the page shows it")
        row = round(100 * time)
        assert page.locator(".phase").inner_text() == str(MOTION.phases[row])
        assert page.locator(".hinge-angle").inner_text() == f"{round(np.degrees(MOTION.hinge_angle[row]))}°"


def test_play_and_pause(page: Page, viewer: Viewer) -> None:
    """Play moves the playhead on, in server and page; pause leaves both at the same time."""
    scrub(page, 0.0)
    wait_until(page, lambda: viewer.playback.time == 0.0, "the playhead is at the start")
    page.get_by_role("button", name="Play", exact=True).click()
    wait_until(page, lambda: viewer.playback.playing and viewer.playback.time > 0.2, "it plays")
    page.get_by_role("button", name="Pause", exact=True).click()
    wait_until(page, lambda: not viewer.playback.playing, "it pauses")
    page.get_by_role("button", name="Play", exact=True).wait_for()
    # samples are 10 ms apart, and the page shows two digits
    wait_until(page, lambda: abs(shown_time(page) - viewer.playback.time) < 0.0151, "both agree")


def test_toggles(page: Page, viewer: Viewer) -> None:
    """What is switched off is no longer shown, which the picture and the server's state tell."""
    before = page.screenshot()
    page.get_by_label("Object", exact=True).locator("visible=true").last.click()
    wait_until(page, lambda: not viewer.appearance.object, "the server hides the object")
    wait_until(page, lambda: page.screenshot() != before, "the picture changes")
    page.get_by_label("Object", exact=True).locator("visible=true").last.click()
    wait_until(page, lambda: viewer.appearance.object, "the server shows the object")
    choose(page, "Hands", "links")
    wait_until(page, lambda: viewer.appearance.hands == "links", "the links are shown")


def test_save(page: Page, tmp_path: Path) -> None:
    """The motion file that a browser gets is the motion that is shown."""
    page.get_by_role("tab", name="Save").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save motion (.npz)").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    saved = load_motion(path)
    np.testing.assert_array_equal(saved.joint_q, MOTION.joint_q)
    page.get_by_role("tab", name="View").click()


def test_second_browser_and_reload(page: Page, browser: Browser, viewer: Viewer) -> None:
    """Another browser sees and steers the same; one that reloads or leaves in the middle of a drag disturbs nobody."""
    scrub(page, 1.0)
    other = open_page(browser, viewer)
    wait_until(other, lambda: shown_time(other) == 1.0, "the other one sees the same")
    scrub(other, 2.0)
    wait_until(page, lambda: shown_time(page) == 2.0, "this one follows")
    handle = other.get_by_role("slider").first.bounding_box()
    assert handle is not None
    other.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
    other.mouse.down()
    other.mouse.move(handle["x"] + 20, handle["y"])
    other.close()
    page.reload()
    page.locator(".phase").wait_for()
    scrub(page, 0.3)
    wait_until(page, lambda: shown_time(page) == 0.3, "it goes on")


def test_pick(page: Page, viewer: Viewer) -> None:
    """Other subjects and what they offer can be picked; what cannot be saved is said, and nothing ends."""
    choose(page, "Show", "references")
    wait_until(page, lambda: viewer.subject.title == "references of lidded-box", "references are shown")
    choose(page, "Kind", "grasp")
    page.locator(".phase", has_text="grasp").wait_for()
    page.get_by_role("tab", name="Save").click()
    page.get_by_role("button", name="Save motion (.npz)").click()
    page.get_by_text("references are no motion").first.wait_for()
    choose(page, "Show", "motion")
    wait_until(page, lambda: viewer.subject.title == "motion", "the motion is back")


def test_live_task(page: Page, viewer: Viewer) -> None:
    """A task plays while it is simulated, and another of its environments can be looked at."""
    choose(page, "Show", "live")
    wait_until(page, lambda: viewer.subject.title == "live: pd-ik" and viewer.subject.tracks, "it is simulated")
    if not viewer.playback.playing:
        page.get_by_role("button", name="Play", exact=True).click()
    wait_until(page, lambda: shown_time(page) > 0.2, "it plays")
    page.get_by_role("button", name="Pause", exact=True).click()
    choose(page, "Environment", "1")
    wait_until(page, lambda: viewer.subject.tracks[0].label == "environment 1", "the other one is shown")


def test_make(page: Page, viewer: Viewer, tmp_path: Path) -> None:
    """A motion is made toward the angle that is asked for, shown, and can be saved as USD."""
    page.get_by_role("tab", name="Make").click()
    fill(page, "Angle [rad]", 0.7)
    page.get_by_role("button", name="Generate anew").click()
    wait_until(page, lambda: "PD+IK" in viewer.subject.title, "the motion is made")
    motion = viewer.subject.motion()
    assert motion.target_angle == pytest.approx(0.7)
    page.get_by_text(f"opened to {motion.metrics['final_angle']:.2f} rad of 0.70 rad").wait_for()
    page.get_by_role("tab", name="Save").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save USD (.usdc)").click()
    download.value.save_as(tmp_path / "motion.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "motion.usdc"))
    assert stage.GetRootLayer().customLayerData["targetAngle"] == pytest.approx(0.7)
    assert stage.GetEndTimeCode() - stage.GetStartTimeCode() == len(motion.time) - 1


def test_sleeps_while_nobody_watches(page: Page, viewer: Viewer) -> None:
    """Without a browser nothing moves on, and a browser that comes later finds everything as it was."""
    viewer.playback.playing = True
    page.goto("about:blank")
    wait_until(page, lambda: not viewer.is_watched, "the browser is gone")
    pass_by(viewer)
    time = viewer.playback.time
    for _ in range(3):
        pass_by(viewer)
    assert viewer.playback.time == time


def pass_by(viewer: Viewer) -> None:
    """Let the viewer's thread, which may be asleep, go around once."""
    passed = threading.Event()
    viewer.post(passed.set)
    assert passed.wait(PATIENCE)


def choose(page: Page, label: str, option: str) -> None:
    """Choose an option of one of the panel's lists."""
    page.get_by_label(label, exact=True).locator("visible=true").last.click()
    page.get_by_role("option", name=option, exact=True).click()
