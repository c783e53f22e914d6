"""Measures the viewer in a real browser: frames per second, latency, the server's share of a core, growth of memory.

    python -m tools.measure_viewer MOTION.npz --seconds 600

It serves the motion by a process of its own, opens it in Chromium and lets it play. A browser that draws on the
processor shares it with the server: its frames per second tell more about the processor than about the viewer. What the
server sends is counted by a second client that draws nothing.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
import viser
import zstandard
from playwright.sync_api import Page
from websockets.sync.client import connect

from tests.viewer.browser import open_browser

COUNT_FRAMES = """() => {
  window.frames_drawn = 0;
  const count = () => { window.frames_drawn++; requestAnimationFrame(count); };
  requestAnimationFrame(count);
}"""
COUNTED = 20.0
"""How long the samples are counted that the server sends [s]."""
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
            text += process.stdout.readline()
        try:
            yield json.loads(text)["url"], process.pid
        finally:
            process.terminate()


def cpu_seconds(process: int) -> float:
    """Processor time that a process has taken [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory(process: int) -> float:
    """Resident memory of a process [MiB]."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def latencies(page: Page, count: int) -> list[float]:
    """Times from a click on play or pause until the button says so [s], there and back through the server."""
    found = []
    for index in range(count):
        name = ("Pause", "Play")[index % 2]
        other = ("Play", "Pause")[index % 2]
        start = time.perf_counter()
        page.get_by_role("button", name=name, exact=True).click()
        page.get_by_role("button", name=other, exact=True).wait_for()
        found.append(time.perf_counter() - start)
    return found


def samples_per_second(url: str) -> float:
    """How often the server sends where a hand is; a browser must keep it awake."""
    arrivals: list[float] = []
    hand = None
    with connect(url.replace("http", "ws", 1), subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as client:
        # what the scene holds comes first
        begin = time.monotonic() + 3.0
        while time.monotonic() < begin + COUNTED:
            packet = client.recv()
            size = int.from_bytes(packet[8:16], "little")
            content = msgspec.msgpack.decode(zstandard.decompress(packet[16 : 16 + size]))
            for message in content["messages"]:
                if message["type"] == "SetBonePositionMessage" and message["bone_index"] == 0:
                    hand = hand or message["name"]
                    arrivals += [time.monotonic()] if message["name"] == hand else []
    return sum(arrival > begin for arrival in arrivals) / COUNTED


def main() -> None:
    """Measure and print JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motion", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to watch")
    parser.add_argument("--width", type=int, default=960, help="of the browser's window [px]")
    parser.add_argument("--height", type=int, default=720, help="of the browser's window [px]")
    options = parser.parse_args()
    with serve(options.motion) as (url, server), open_browser() as browser:
        idle_start, idle_cpu = time.monotonic(), cpu_seconds(server)
        time.sleep(5.0)
        idle = (cpu_seconds(server) - idle_cpu) / (time.monotonic() - idle_start)
        page = browser.new_page(viewport={"width": options.width, "height": options.height})
        page.set_default_timeout(120_000)
        page.goto(url)
        page.locator(".phase").wait_for()
        page.wait_for_timeout(5000)
        page.evaluate(COUNT_FRAMES)
        first = page.evaluate("window.frames_drawn")
        start, cpu = time.monotonic(), cpu_seconds(server)
        times, sizes = [], []
        while time.monotonic() - start < options.seconds:
            page.wait_for_timeout(1000)
            times.append(time.monotonic() - start)
            sizes.append(memory(server))
        elapsed = time.monotonic() - start
        frames = page.evaluate("window.frames_drawn") - first
        share = (cpu_seconds(server) - cpu) / elapsed
        half = len(times) // 2
        slope = np.polyfit(times[half:], sizes[half:], 1)[0] * 60 if half > 1 else float("nan")
        found = {
            "seconds": round(elapsed, 1),
            "browser_frames_per_second": round(frames / elapsed, 1),
            "server_cpu_share_idle": round(idle, 4),
            "server_cpu_share_playing": round(share, 3),
            "server_memory_mib": [round(sizes[0], 1), round(sizes[-1], 1)],
            "server_memory_mib_per_minute": round(float(slope), 3),
            "samples_sent_per_second": round(samples_per_second(url), 1),
            "play_pause_latency_s": round(statistics.median(latencies(page, 10)), 3),
        }
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
