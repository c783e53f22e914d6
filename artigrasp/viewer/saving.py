"""What the panel's buttons send to a browser: files made in a folder that then goes away."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from artigrasp.export.picture import Style, render_video
from artigrasp.export.usd import export_usd
from artigrasp.motion.file import save_motion
from artigrasp.motion.motion import Motion
from artigrasp.viewer.jobs import Progress

VIDEO, VIDEO_RATE = Style(width=480, height=400, target=True), 15.0
"""Of a video, and its pictures per second; small, since somebody waits for it."""


def motion_bytes(motion: Motion, progress: Progress) -> bytes:
    """A motion as its file."""
    return _written("motion.npz", lambda path: save_motion(path, motion))


def usd_bytes(motion: Motion, progress: Progress) -> bytes:
    """A motion as a USD animation."""
    return _written("motion.usdc", lambda path: export_usd(motion, path))


def video_bytes(motion: Motion, progress: Progress) -> bytes:
    """A motion as a video, as ``artigrasp render`` makes it."""
    return _written(
        "motion.mp4", lambda path: render_video(motion, path, rate=VIDEO_RATE, style=VIDEO, progress=progress)
    )


SAVERS: dict[str, tuple[str, Callable[[Motion, Progress], bytes]]] = {
    "motion": (".npz", motion_bytes),
    "USD": (".usdc", usd_bytes),
    "video": (".mp4", video_bytes),
}
"""What can be saved: the ending of its file, and what makes it."""


def file_stem(title: str) -> str:
    """A file name without ending for something with this title."""
    return "".join(letter if letter.isalnum() else "-" for letter in title).strip("-")[:60] or "motion"


def _written(name: str, write: Callable[[Path], None]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="artigrasp-") as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
