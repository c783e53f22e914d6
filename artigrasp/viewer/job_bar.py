"""How far the work in the background is, in the panel."""

from collections.abc import Callable

from viser import GuiApi, Icon

from artigrasp.viewer.events import from_people
from artigrasp.viewer.jobs import JobState


class JobBar:
    """A bar that is there while something is being done, and a button to give it up."""

    def __init__(self, gui: GuiApi, cancel: Callable[[], None]) -> None:
        """Put it where the panel is being filled; ``cancel`` is called in a thread of the server."""
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._stop = gui.add_button("Cancel", icon=Icon.PLAYER_STOP, visible=False, color="gray")
        self._stop.on_click(from_people(lambda event: cancel()))

    def show(self, job: JobState) -> None:
        """Say how far the work is."""
        self._bar.visible = self._stop.visible = bool(job.name)
        self._stop.label = f"Cancel {job.name}" if job.name else "Cancel"
        self._bar.value = min(100.0 * job.done / job.total, 100.0) if job.total else 0.0
