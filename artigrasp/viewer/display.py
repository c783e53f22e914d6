"""What the viewer draws: tracks side by side in the studio."""

from collections.abc import Sequence

from viser import ViserServer

from artigrasp.viewer.appearance import Appearance
from artigrasp.viewer.figure import Figure
from artigrasp.viewer.recording import Track
from artigrasp.viewer.studio import Studio


class Display:
    """A figure for each track that is shown. Figures are kept, for tracks that they fit may come again.

    Attributes:
        appearance: What of them is shown.
    """

    def __init__(self, server: ViserServer, appearance: Appearance) -> None:
        """Prepare the studio; nothing stands in it yet."""
        self._scene, self._studio = server.scene, Studio(server)
        self._figures: list[Figure] = []
        self._keys: list[tuple[str, ...]] = []
        self._kept: dict[tuple[int, tuple[str, ...]], Figure] = {}
        self.appear(appearance)

    def appear(self, appearance: Appearance) -> None:
        """Show it as the panel says."""
        self.appearance = appearance
        self._studio.appear(appearance)
        for figure in self._figures:
            figure.appear(appearance)

    def set_tracks(self, tracks: Sequence[Track]) -> None:
        """Draw other tracks, with the figures that stand there if they fit."""
        keys = [Figure.key(track) for track in tracks]
        if keys != self._keys:
            self._set_up(keys, tracks)
        for figure, track in zip(self._figures, tracks, strict=True):
            figure.set_track(track)

    def show(self, tracks: Sequence[Track], time: float) -> None:
        """Draw what these tracks recorded at a time [s]."""
        for figure, track in zip(self._figures, tracks, strict=False):
            if track.recording.count:
                figure.show(track.recording.at(time))

    def _set_up(self, keys: list[tuple[str, ...]], tracks: Sequence[Track]) -> None:
        """Take figures for tracks, those that have been drawn before if they fit, and hide the others."""
        for figure in self._figures:
            figure.hide()
        self._figures, self._keys = [], keys
        places = self._studio.set_up(tracks)
        for index, (key, track, place) in enumerate(zip(keys, tracks, places, strict=True)):
            if (index, key) not in self._kept:
                self._kept[index, key] = Figure(self._scene, f"/figure{len(self._kept)}", track)
            figure = self._kept[index, key]
            figure.place(place)
            figure.appear(self.appearance)
            self._figures.append(figure)
