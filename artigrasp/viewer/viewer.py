"""The viewer: one thread that owns the scene, the panel and the playhead, and sleeps while nobody watches."""

import logging
import queue
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import imageio.v3 as imageio
from viser import ClientHandle

from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.motion.motion import Motion
from artigrasp.viewer.appearance import Appearance
from artigrasp.viewer.display import Display
from artigrasp.viewer.jobs import Jobs
from artigrasp.viewer.maker import Maker, error_html, motion_html
from artigrasp.viewer.motion_subject import MotionSubject
from artigrasp.viewer.panel import Panel
from artigrasp.viewer.playback import Playback
from artigrasp.viewer.saving import SAVERS, file_stem
from artigrasp.viewer.server import Server
from artigrasp.viewer.subject import Subject
from artigrasp.viewer.wish import Wish, fulfil

logger = logging.getLogger(__name__)

FRAME = 1 / 40
"""Between two frames while something plays [s]."""
GLANCE = 0.2
"""Between two looks at what is simulated or made while nothing plays but somebody watches [s]."""
PANEL = 0.1
"""Between two updates of the panel while something plays [s]."""
PLOT = 0.5
"""The same for plots [s]."""
LONGEST_STEP = 0.1
"""Of the playhead, should the viewer be held up [s]."""
SAMPLE = 0.01
"""Between two samples of a motion [s]."""
FOREVER = 3600.0
"""As long as makes no difference [s]."""
HOLD = 0.5
"""How long the playhead stays where somebody put it [s]."""
RENDER_TIME = 30.0
"""How long to wait for a browser's picture [s]."""


class Viewer:
    """Shows subjects in every browser that connects; all of them see and steer the same, each with its own camera.

    What people ask for arrives from other threads and is handed to the one that runs :meth:`run`; nothing else touches
    the scene. See :class:`artigrasp.viewer.panel.Requests` for what they may ask.

    Attributes:
        playback: Where in time it is.
        subject: What is viewed.
    """

    def __init__(
        self,
        subjects: Mapping[str, Subject],
        server: Server,
        *,
        objects: Sequence[str],
        policies: Mapping[str, Path],
        simulator: SimulatorConfig = SimulatorConfig(),
        appearance: Appearance | None = None,
    ) -> None:
        """Show the first of some subjects.

        Args:
            subjects: By the names that the panel offers them under, at least one.
            server: Where browsers connect.
            objects: Objects of which motions can be made.
            policies: Policy files that can make them, by name.
            simulator: Where they are simulated.
            appearance: What is shown at first, if not the usual.
        """
        self._server, self._policies, self._simulator = server, policies, simulator
        self._calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._subjects = dict(subjects)
        self.playback = Playback(playing=True)
        self.subject = next(iter(self._subjects.values()))
        self._generation = -1
        self._note = ""
        self._held_until = self._panel_due = self._plot_due = 0.0
        self._stopped = False
        self._display = Display(server.viser, appearance or Appearance())
        self._jobs = Jobs(self.post)
        self._maker = Maker(server.viser.scene, self.post, objects, policies, self._generate, self._jobs.cancel)
        terms = dict.fromkeys(term for subject in subjects.values() for term in subject.reward_terms)
        self._panel = Panel(server.viser.gui, self, self._maker.build, tuple(terms), self.appearance)
        self._panel.show_subjects(list(self._subjects), next(iter(self._subjects)))
        server.on_change(lambda: self.post(lambda: None))

    @property
    def url(self) -> str:
        """Its address in a browser on this machine."""
        return self._server.url

    @property
    def is_watched(self) -> bool:
        """Whether a browser is connected."""
        return self._server.is_watched

    @property
    def appearance(self) -> Appearance:
        """What is shown."""
        return self._display.appearance

    def post(self, call: Callable[[], None]) -> None:
        """Let the viewer's thread do something soon."""
        self._calls.put(call)

    def stop(self) -> None:
        """End :meth:`run`."""
        self.post(lambda: setattr(self, "_stopped", True))

    def run(self) -> None:
        """Serve until :meth:`stop`, or until the user interrupts."""
        last = time.monotonic()
        due = last
        try:
            while not self._stopped:
                self._answer(due - time.monotonic())
                now = time.monotonic()
                # while nobody watched, no time has passed
                elapsed, last = min(now - last, LONGEST_STEP), now
                watched = self._server.is_watched and not self._stopped
                if watched and not self._do(partial(self._tick, now, elapsed)):
                    # or it would fail again at the next frame
                    self.playback.playing = False
                due = now + self._patience()
        finally:
            self._jobs.close()
            for subject in self._subjects.values():
                subject.close()

    def choose_subject(self, name: str) -> None:
        """See :class:`artigrasp.viewer.panel.Requests`, as for all that follow."""

        def choose() -> None:
            self.subject, self._generation = self._subjects[name], -1
            self._note = ""

        self.post(choose)

    def pick(self, label: str, option: str) -> None:
        """Choose an option of one of the subject's pickers."""

        def pick() -> None:
            self._note = ""
            self.subject.pick(label, option)

        self.post(pick)

    def toggle(self) -> None:
        """Play or pause."""
        self.post(self.playback.toggle)

    def seek(self, time_: float) -> None:
        """Put the playhead somewhere."""

        def seek() -> None:
            self.playback.seek(time_)
            self._held_until = time.monotonic() + HOLD

        self.post(seek)

    def step(self, count: int) -> None:
        """Pause, and move the playhead by so many samples."""

        def step() -> None:
            self.playback.playing = False
            self.playback.seek(self.playback.time + count * SAMPLE)

        self.post(step)

    def begin_anew(self) -> None:
        """Go back to the start, of another episode if there is one."""

        def begin() -> None:
            self.playback.seek(0.0)
            self.subject.begin_anew()

        self.post(begin)

    def set_speed(self, speed: float) -> None:
        """Play at a share of real time."""
        self.post(lambda: setattr(self.playback, "speed", speed))

    def set_loop(self, loop: bool) -> None:
        """Whether to go on at the end."""
        self.post(lambda: setattr(self.playback, "loop", loop))

    def set_appearance(self, appearance: Appearance) -> None:
        """Show other things."""
        self.post(lambda: self._display.appear(appearance))

    def save(self, what: str, client: ClientHandle) -> None:
        """Make a file in the background and send it to a browser."""
        ending, make = SAVERS[what]
        subject = self.subject

        def send(content: bytes) -> None:
            self._send(client, file_stem(subject.title) + ending, content)

        self.post(
            lambda: self._jobs.start(
                f"saving the {what}", lambda progress: make(subject.motion(), progress), send, self._complain
            )
        )

    def cancel(self) -> None:
        """Give up what is done in the background."""
        self.post(self._jobs.cancel)

    def screenshot(self, client: ClientHandle) -> None:
        """Send what a browser shows to it; called in a thread that may wait for the browser."""
        camera = client.camera
        try:
            picture = client.get_render(camera.image_height, camera.image_width, timeout=RENDER_TIME)
        except Exception as error:
            # the browser may be gone, or take too long
            message = f"no screenshot: {error}"
            self.post(lambda: self._complain(message))
            return
        content = imageio.imwrite("<bytes>", picture, extension=".png")
        self._send(client, f"{file_stem(self.subject.title)}.png", content)

    def _generate(self, wish: Wish) -> None:
        """Make a motion in the background and show it."""
        self._maker.say("")
        self._jobs.start(
            "generating",
            lambda progress: fulfil(wish, self._policies, progress, self._simulator),
            lambda motion: self._add_motion(wish, motion),
            lambda message: self._maker.say(error_html(message)),
        )

    def _add_motion(self, wish: Wish, motion: Motion) -> None:
        name = f"{len(self._subjects)}: {wish.object}, {wish.what}, {wish.actor}"
        self._subjects[name] = MotionSubject([(name, motion)])
        self._panel.show_subjects(list(self._subjects), name)
        self._maker.say(motion_html(motion))
        self.subject, self._generation = self._subjects[name], -1
        self.playback.playing = True

    def _patience(self) -> float:
        """How long to sleep unless somebody asks for something [s]."""
        if not self._server.is_watched:
            return FOREVER
        if self.playback.is_moving:
            return FRAME
        waits = self.subject.is_live or self._jobs.is_busy or time.monotonic() < self._held_until
        return GLANCE if waits else FOREVER

    def _answer(self, patience: float) -> None:
        """Wait for somebody to ask for something, at most so long [s], and do it all."""
        try:
            self._do(self._calls.get(timeout=max(patience, 0.0)))
            while True:
                self._do(self._calls.get_nowait())
        except queue.Empty:
            pass

    def _do(self, call: Callable[[], None]) -> bool:
        """Do something that may go wrong without ending the viewer; whether it went well."""
        try:
            call()
            return True
        except UserError as error:
            self._complain(str(error))
        except Exception as error:
            logger.exception("the viewer failed at something")
            self._complain(f"this failed: {error}")
        return False

    def _complain(self, message: str) -> None:
        self._note = message
        self._server.notify(message)

    def _tick(self, now: float, elapsed: float) -> None:
        """Move the playhead on and show what is there."""
        subject, playback = self.subject, self.playback
        recorded = subject.demand(playback.time)
        if subject.generation != self._generation:
            self._show_subject()
        was_playing = playback.playing
        if now >= self._held_until and playback.advance(elapsed, recorded) and subject.is_live and playback.loop:
            subject.begin_anew()
        self._display.show(subject.tracks, playback.time)
        self._server.flush()
        if now >= self._panel_due or not was_playing:
            self._show_panel(now)

    def _show_subject(self) -> None:
        """Draw other tracks, and fit playhead and panel to them."""
        subject = self.subject
        tracks, begins = subject.tracks, self._generation < 0
        self._generation = subject.generation
        self._display.set_tracks(tracks)
        if begins:
            self.playback.restart(subject.duration)
        else:
            self.playback.duration = subject.duration
            self.playback.seek(self.playback.time)
        self._panel.show_subject(subject, self.playback)
        if begins and tracks:
            aim = tracks[0].aim
            self._maker.propose(tracks[0].objects[0].name, None if aim is None else aim.angle)

    def _show_panel(self, now: float) -> None:
        self._panel_due = now + PANEL
        playback, tracks = self.playback, self.subject.tracks
        track = tracks[0] if tracks else None
        if now >= self._held_until:
            self._panel.show_playback(playback)
        self._panel.show_status(self.subject, track, playback.time, self.subject.status or self._note)
        self._maker.show_job(self._jobs.state)
        self._panel.show_job(self._jobs.state)
        if track is not None and (now >= self._plot_due or not playback.playing):
            self._plot_due = now + PLOT
            self._panel.show_plots(track, playback.time)

    def _send(self, client: ClientHandle, name: str, content: bytes) -> None:
        client.send_file_download(name, content, save_immediately=True)
