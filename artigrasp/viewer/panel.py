"""The panel beside the scene: it shows what the viewer tells it, and tells the viewer what people ask for."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from viser import ClientHandle, GuiApi, GuiDropdownHandle, GuiEvent, GuiInputHandle, Icon

from artigrasp.viewer.appearance import HAND_LOOKS, STRONG, Appearance, force_colours
from artigrasp.viewer.events import from_people
from artigrasp.viewer.gauge import metrics_html, scale_html, status_html
from artigrasp.viewer.job_bar import JobBar
from artigrasp.viewer.jobs import JobState
from artigrasp.viewer.playback import SPEEDS, Playback
from artigrasp.viewer.plots import Plots
from artigrasp.viewer.recording import Track
from artigrasp.viewer.saving import SAVERS
from artigrasp.viewer.subject import Picker, Subject


class Requests(Protocol):
    """What people ask of the viewer; all of these return at once."""

    def choose_subject(self, name: str) -> None:
        """Show another subject."""
        ...

    def pick(self, label: str, option: str) -> None:
        """Choose an option of one of the subject's pickers."""
        ...

    def toggle(self) -> None:
        """Play or pause."""
        ...

    def seek(self, time: float) -> None:
        """Put the playhead somewhere [s], and hold it there for a moment."""
        ...

    def step(self, count: int) -> None:
        """Pause, and move the playhead by so many samples."""
        ...

    def begin_anew(self) -> None:
        """Go back to the start, of another episode if there is one."""
        ...

    def set_speed(self, speed: float) -> None:
        """Play at a share of real time."""
        ...

    def set_loop(self, loop: bool) -> None:
        """Whether to go on at the end."""
        ...

    def set_appearance(self, appearance: Appearance) -> None:
        """Show other things."""
        ...

    def save(self, what: str, client: ClientHandle) -> None:
        """Send a file to a browser."""
        ...

    def cancel(self) -> None:
        """Give up what is done in the background."""
        ...

    def screenshot(self, client: ClientHandle) -> None:
        """Send what a browser shows to it as a picture."""
        ...


class Panel:
    """The widgets; ``maker`` is called where those are to be that make new motions."""

    def __init__(
        self,
        gui: GuiApi,
        requests: Requests,
        maker: Callable[[GuiApi], None],
        reward_terms: Sequence[str],
        appearance: Appearance,
    ) -> None:
        """Build it, with a plot of these terms of the reward if there are any."""
        self._gui, self._requests = gui, requests
        self._appearance = appearance
        self._told = 0.0
        self._subjects = gui.add_dropdown("Show", ("",), visible=False)
        self._subjects.on_update(from_people(lambda event: requests.choose_subject(event.target.value)))
        self._status = gui.add_html("")
        self._build_playback()
        self._pickers = gui.add_folder(None)
        self._picker_handles: list[GuiDropdownHandle[str]] = []
        tabs = gui.add_tab_group()
        with tabs.add_tab("View", Icon.EYE):
            self._build_view()
        with tabs.add_tab("Plots", Icon.CHART_LINE):
            self._plots = Plots(gui, reward_terms)
            self._metrics = gui.add_html(metrics_html({}))
        with tabs.add_tab("Make", Icon.WAND):
            maker(gui)
        with tabs.add_tab("Save", Icon.DOWNLOAD):
            self._build_save()

    def show_subjects(self, names: Sequence[str], chosen: str) -> None:
        """Offer these subjects."""
        self._subjects.options = tuple(names)
        self._subjects.value = chosen
        self._subjects.visible = len(names) > 1

    def show_subject(self, subject: Subject, playback: Playback) -> None:
        """Fit pickers and timeline to a subject."""
        self._timeline.max = max(playback.duration, 0.01)
        self._playback.visible = subject.is_live or playback.duration > 0
        self._loop.label = "Go on with the next episode" if subject.is_live else "Loop"
        self._show_pickers(subject.pickers)

    def show_playback(self, playback: Playback) -> None:
        """Say where the playhead is and what it does."""
        self._play.label = "Pause" if playback.playing else "Play"
        self._play.icon = Icon.PLAYER_PAUSE if playback.playing else Icon.PLAYER_PLAY
        value = min(playback.time, self._timeline.max)
        if value != self._told and self._timeline.value == value:
            # somebody put it there, but what was on its way to their browser may have moved it back since
            self._timeline.value = value - self._timeline.step
        self._timeline.value = self._told = value

    def show_status(self, subject: Subject, track: Track | None, time: float, note: str) -> None:
        """Say what goes on at a time [s]."""
        if track is None or track.recording.count == 0:
            self._status.content = status_html(
                title=subject.title, phase="", time=0.0, angle=0.0, target=None, note=note
            )
            return
        sample = track.recording.at(time)
        self._status.content = status_html(
            title=subject.title,
            phase=sample.phase,
            time=sample.time,
            angle=sample.hinge_angle,
            target=None if track.aim is None else track.aim.angle,
            note=note,
        )

    def show_job(self, job: JobState) -> None:
        """Say how far the work in the background is."""
        self._job.show(job)

    def show_plots(self, track: Track, time: float) -> None:
        """Draw curves and metrics."""
        self._plots.show(track.recording, None if track.aim is None else track.aim.angle, time)
        self._metrics.content = metrics_html(track.metrics)

    def _build_playback(self) -> None:
        gui, requests = self._gui, self._requests
        self._playback = gui.add_folder(None)
        with self._playback:
            self._play = gui.add_button("Play", icon=Icon.PLAYER_PLAY, hint="space")
            self._play.on_click(from_people(lambda event: requests.toggle()))
            self._timeline = gui.add_slider("Time [s]", 0.0, 1.0, 0.01, 0.0)
            self._timeline.on_update(from_people(lambda event: requests.seek(event.target.value)))
            self._steps = gui.add_button_group("Step", ("<", ">", "reset"), hint="arrow keys, home")
            moves = {"<": lambda: requests.step(-1), ">": lambda: requests.step(1), "reset": requests.begin_anew}
            self._steps.on_click(from_people(lambda event: moves[event.target.value]()))
            self._speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1x")
            self._speed.on_update(from_people(lambda event: requests.set_speed(SPEEDS[event.target.value])))
            self._loop = gui.add_checkbox("Loop", True)
            self._loop.on_update(from_people(lambda event: requests.set_loop(event.target.value)))
        for label, key, act in (
            ("Play or pause", "space", requests.toggle),
            ("Step back", "arrowleft", moves["<"]),
            ("Step forward", "arrowright", moves[">"]),
            ("Reset", "home", moves["reset"]),
        ):
            gui.add_command(label, hotkey=key).on_trigger(lambda event, act=act: act())

    def _build_view(self) -> None:
        gui, first = self._gui, self._appearance
        self._add(gui.add_dropdown("Hands", HAND_LOOKS, initial_value=first.hands), "hands")
        self._add(gui.add_slider("Hand opacity", 0.1, 1.0, 0.05, first.hand_opacity), "hand_opacity")
        self._add(gui.add_checkbox("Object", first.object), "object")
        self._add(gui.add_checkbox("Colliders", first.colliders, hint="the convex pieces that collide"), "colliders")
        self._add(gui.add_checkbox("Contact forces", first.contacts), "contacts")
        gui.add_html(scale_html([f"rgb({r},{g},{b})" for r, g, b in force_colours()], STRONG))
        self._add(
            gui.add_checkbox("Reference contacts", first.target_contacts, hint="green where the hand touches"),
            "target_contacts",
        )
        self._add(gui.add_slider("Reference ghost", 0.0, 1.0, 0.05, first.reference_ghost), "reference_ghost")
        self._add(gui.add_slider("Target ghost", 0.0, 1.0, 0.05, first.target_ghost), "target_ghost")
        self._add(gui.add_checkbox("Fine", first.fine, hint="shadows and rounder hands; slow without a GPU"), "fine")

    def _add(self, widget: GuiInputHandle[Any], field: str) -> None:
        def update(event: GuiEvent) -> None:
            self._appearance = replace(self._appearance, **{field: event.target.value})
            self._requests.set_appearance(self._appearance)

        widget.on_update(from_people(update))

    def _build_save(self) -> None:
        gui, requests = self._gui, self._requests
        icons = {"motion": Icon.FILE_DOWNLOAD, "USD": Icon.CUBE, "video": Icon.MOVIE}
        for what, (ending, _) in SAVERS.items():
            button = gui.add_button(f"Save {what} ({ending})", icon=icons[what])
            button.on_click(from_people(partial(self._save, what)))
        button = gui.add_button("Save screenshot (.png)", icon=Icon.CAMERA)
        button.on_click(from_people(lambda event: requests.screenshot(event.client)))
        self._job = JobBar(gui, requests.cancel)

    def _save(self, what: str, event: GuiEvent) -> None:
        self._requests.save(what, event.client)

    def _show_pickers(self, pickers: Sequence[Picker]) -> None:
        if [handle.label for handle in self._picker_handles] != [picker.label for picker in pickers]:
            for handle in self._picker_handles:
                handle.remove()
            with self._pickers:
                self._picker_handles = [self._make_picker(picker) for picker in pickers]
        for handle, picker in zip(self._picker_handles, pickers, strict=True):
            if handle.options != picker.options:
                handle.options = picker.options
            handle.value = picker.value
            handle.visible = len(picker.options) > 1

    def _make_picker(self, picker: Picker) -> GuiDropdownHandle[str]:
        handle = self._gui.add_dropdown(picker.label, picker.options, initial_value=picker.value)
        handle.on_update(from_people(lambda event: self._requests.pick(picker.label, event.target.value)))
        return handle
