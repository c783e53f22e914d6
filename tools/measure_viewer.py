"""Measures the viewer in a real browser: frames, latency, processor time and memory of server and page.

    python -m tools.measure_viewer MOTION.npz --seconds 600

It serves the motion by a process of its own and opens it in Chromium. Without a graphics card a browser draws on the
processor, which then is nearly all that it does; so the page is measured with and without that: once its calls to draw
do nothing, what remains is what viewer and page cost, whatever draws. Frames per second depend on what else the machine
does, processor time per frame hardly does.

What is measured, in this order: the server before anybody connects; latencies of the play button and of a scrub in the
page that draws nothing, and that page playing for so many seconds; how often the server sends samples; the page that
draws on the processor, fine and coarse; several browsers that come, reload and go; the server after they have gone.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from playwright.sync_api import Browser, CDPSession, Page
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.viewer.browser import open_browser

COUNT_FRAMES = """(() => {
  const draw = %s;
  window.frames_drawn = 0;
  let drawn = false;
  for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
    const call = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...rest) {
      drawn = true;
      if (draw) call.apply(this, rest);
    };
  }
  const count = () => {
    window.frames_drawn += drawn;
    drawn = false;
    requestAnimationFrame(count);
  };
  requestAnimationFrame(count);
})()"""
"""Counts frames in which the page has drawn something; whether it really draws is to be filled in."""
CHOOSE_TIME = """([id, time]) => {
  const box = document.getElementById(id).parentElement.querySelector("input[inputmode]");
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(box, time);
  const start = performance.now();
  box.dispatchEvent(new Event("input", {bubbles: true}));
  return new Promise((done) => {
    const look = () => document.querySelector(".sample-time").innerText === Number(time).toFixed(2) + " s"
      ? done((performance.now() - start) / 1000) : setTimeout(look, 1);
    look();
  });
}"""
"""Puts the playhead somewhere by the box beside the timeline, and takes the time until the page shows that sample."""
PUSH = """([name, other]) => {
  const find = (text) => [...document.querySelectorAll("button")].find((each) => each.innerText.trim() === text);
  const start = performance.now();
  find(name).click();
  return new Promise((done) => {
    const look = () => find(other) ? done((performance.now() - start) / 1000) : setTimeout(look, 1);
    look();
  });
}"""
"""Plays or pauses, and takes the time until the button says so: there and back through the server."""
COUNTED = 20.0
"""How long frames and samples are counted [s]."""
TICKS = os.sysconf("SC_CLK_TCK")


@contextmanager
def serve(motion: Path) -> Iterator[tuple[str, int]]:
    """Start `artigrasp view`; its address and process id."""
    program = Path(sys.executable).with_name("artigrasp")
    command = [str(program), "view", "motion", str(motion), "--port", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        text = ""
        while not text.rstrip().endswith("}"):
            line = process.stdout.readline()
            if not line:
                raise SystemExit(f"{' '.join(command)} ended")
            text += line
        try:
            yield json.loads(text)["url"], process.pid
        finally:
            process.terminate()


def stat(process: int) -> list[str]:
    """What the system tells of a process after its name: state, parent, and so on."""
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()


def cpu_seconds(process: int) -> float:
    """Processor time that a process has taken [s]."""
    fields = stat(process)
    return (int(fields[11]) + int(fields[12])) / TICKS


def browser_cpu_seconds() -> dict[str, float]:
    """Processor time of the browser's pages and of what draws for them [s]."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int(stat(int(folder.name))[1]), (folder / "cmdline").read_text()
        except OSError:
            continue
    ours = {os.getpid()}
    while grown := {process for process, (parent, _) in parents.items() if parent in ours} - ours:
        ours |= grown
    found = {"page": 0.0, "drawing": 0.0}
    for process in ours:
        for name, kind in (("page", "--type=renderer"), ("drawing", "--type=gpu-process")):
            if kind in parents.get(process, (0, ""))[1]:
                found[name] += cpu_seconds(process)
    return found


def memory(process: int) -> float:
    """Resident memory of a process [MiB]."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def idle_share(server: int) -> float:
    """Share of a core that the server takes while no browser is connected."""
    start, cpu = time.monotonic(), cpu_seconds(server)
    time.sleep(10.0)
    return round((cpu_seconds(server) - cpu) / (time.monotonic() - start), 4)


def open_page(browser: Browser, url: str, options: argparse.Namespace, *, draws: bool) -> Page:
    """Open the viewer in a page that draws or only does all that leads to it."""
    page = browser.new_page(viewport={"width": options.width, "height": options.height})
    page.set_default_timeout(120_000)
    page.add_init_script(COUNT_FRAMES % str(draws).lower())
    page.goto(url)
    page.locator(".phase").wait_for()
    page.wait_for_timeout(5000)
    return page


def frames(page: Page, seconds: float, on_second: Callable[[], None] = lambda: None) -> dict[str, float]:
    """Frames per second of a page that plays, and the processor time per frame [ms]."""
    first, cpu, start = page.evaluate("window.frames_drawn"), browser_cpu_seconds(), time.monotonic()
    while time.monotonic() < start + seconds:
        page.wait_for_timeout(1000)
        on_second()
    elapsed, count = time.monotonic() - start, page.evaluate("window.frames_drawn") - first
    spent = {name: value - cpu[name] for name, value in browser_cpu_seconds().items()}
    found = {f"{name}_cpu_ms_per_frame": round(1000 * value / max(count, 1), 1) for name, value in spent.items()}
    return {"seconds": round(elapsed, 1), "frames_per_second": round(count / elapsed, 1), **found}


def page_memory(session: CDPSession) -> float:
    """What the page's program holds, rubbish collected [MiB]."""
    session.send("HeapProfiler.collectGarbage")
    metrics = {each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]}
    return float(round(metrics["JSHeapUsedSize"] / 2**20, 1))


def watch(page: Page, server: int, seconds: float) -> dict[str, Any]:
    """Let a page play, and see what server and page take."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    times: list[float] = []
    sizes: list[float] = []
    heap, cpu, start = page_memory(session), cpu_seconds(server), time.monotonic()

    def note() -> None:
        times.append(time.monotonic() - start)
        sizes.append(memory(server))

    found: dict[str, Any] = frames(page, seconds, note)
    share = (cpu_seconds(server) - cpu) / (time.monotonic() - start)
    half = len(times) // 2
    slope = np.polyfit(times[half:], sizes[half:], 1)[0] * 60 if half > 1 else float("nan")
    return found | {
        "server_cpu_share": round(share, 3),
        "server_memory_mib": [round(sizes[0], 1), round(sizes[-1], 1)],
        "server_memory_mib_per_minute_of_second_half": round(float(slope), 3),
        "page_memory_mib": [heap, page_memory(session)],
    }


def latencies(page: Page, count: int) -> dict[str, list[float]]:
    """Median and largest time until the page shows what was asked for, there and back through the server [s]."""
    pushes = [page.evaluate(PUSH, ["Pause", "Play"][:: 1 - 2 * (index % 2)]) for index in range(count)]
    page.evaluate(PUSH, ["Pause", "Play"])
    slider = page.locator("label", has_text="Time [s]").get_attribute("for")
    scrubs = []
    for index in range(count):
        scrubs.append(page.evaluate(CHOOSE_TIME, [slider, f"{0.2 + 0.3 * index:.2f}"]))
        page.wait_for_timeout(100)
    page.evaluate(PUSH, ["Play", "Pause"])
    found = {"play_or_pause": pushes, "scrub": scrubs}
    return {name: [round(statistics.median(each), 3), round(max(each), 3)] for name, each in found.items()}


def samples_per_second(url: str) -> float:
    """How often the server sends where a hand is; a browser must keep it awake."""
    arrivals: list[float] = []
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with connect(url.replace("http", "ws", 1), subprotocols=[protocol], max_size=None) as client:
        # what the scene holds comes first
        begin = time.monotonic() + 3.0
        while time.monotonic() < begin + COUNTED:
            packet = client.recv(decode=False)
            size = int.from_bytes(packet[8:16], "little")
            content = msgspec.msgpack.decode(zstandard.decompress(packet[16 : 16 + size]))
            for message in content["messages"]:
                is_bone = message["type"] == "SetBonePositionMessage" and message["bone_index"] == 0
                if is_bone and message["name"].endswith("/right/skin"):
                    arrivals.append(time.monotonic())
    return round(sum(arrival > begin for arrival in arrivals) / COUNTED, 1)


def come_and_go(browser: Browser, url: str, server: int, options: argparse.Namespace) -> dict[str, Any]:
    """Three browsers at once, each of which reloads, several times over; what the server's memory does."""
    sizes = [memory(server)]
    for _ in range(3):
        pages = [open_page(browser, url, options, draws=False) for _ in range(3)]
        for page in pages:
            page.reload()
            page.locator(".phase").wait_for()
        counts = [frames(page, 3.0)["frames_per_second"] for page in pages]
        for page in pages:
            page.close()
        sizes.append(memory(server))
    return {"frames_per_second_of_each": counts, "server_memory_mib": [round(size, 1) for size in sizes]}


def main() -> None:
    """Measure and print JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motion", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to watch")
    parser.add_argument("--width", type=int, default=960, help="of the browser's window [px]")
    parser.add_argument("--height", type=int, default=720, help="of the browser's window [px]")
    options = parser.parse_args()
    found: dict[str, Any] = {}

    def tell(name: str, value: object) -> None:
        found[name] = value
        print(name, value, file=sys.stderr, flush=True)

    with serve(options.motion) as (url, server), open_browser() as browser:
        tell("server_cpu_share_before_anybody_connects", idle_share(server))
        page = open_page(browser, url, options, draws=False)
        tell("latency_s_median_and_largest", latencies(page, 20))
        tell("page_without_drawing", watch(page, server, options.seconds))
        tell("samples_sent_per_second", samples_per_second(url))
        page.close()
        page = open_page(browser, url, options, draws=True)
        tell("drawing_on_the_processor_fine", frames(page, COUNTED))
        page.get_by_label("Fine").locator("visible=true").last.click()
        page.wait_for_timeout(3000)
        tell("drawing_on_the_processor_coarse", frames(page, COUNTED))
        page.close()
        tell("three_browsers_that_reload", come_and_go(browser, url, server, options))
        time.sleep(2.0)
        tell("server_cpu_share_after_all_have_gone", idle_share(server))
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
