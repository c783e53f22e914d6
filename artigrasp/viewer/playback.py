"""Where in time the viewer is; no browser, no clock of its own."""

from dataclasses import dataclass

SPEEDS = {"0.1x": 0.1, "0.25x": 0.25, "0.5x": 0.5, "1x": 1.0, "2x": 2.0, "4x": 4.0}
"""Speeds that can be picked, as shares of real time."""


@dataclass
class Playback:
    """A playhead on a timeline.

    Attributes:
        duration: Length of the timeline [s].
        time: Where the playhead is, 0 to ``duration`` [s].
        playing: Whether it moves.
        speed: How fast it moves, as a share of real time.
        loop: Whether it begins again at the end.
    """

    duration: float = 0.0
    time: float = 0.0
    playing: bool = False
    speed: float = 1.0
    loop: bool = True

    @property
    def is_moving(self) -> bool:
        """Whether it plays and there is something to play."""
        return self.playing and self.duration > 0

    def advance(self, elapsed: float, recorded: float | None = None) -> bool:
        """Move on by some real time.

        Args:
            elapsed: Real time since the last call [s].
            recorded: Up to where the timeline can be shown yet [s]; the playhead waits there. All of it by default.

        Returns:
            Whether the end was reached, whereupon it begins again or stops.
        """
        if not self.is_moving:
            return False
        end = self.duration if recorded is None else min(recorded, self.duration)
        self.time = min(self.time + elapsed * self.speed, end)
        if self.time < self.duration:
            return False
        if self.loop:
            self.time = 0.0
        else:
            self.playing = False
        return True

    def toggle(self) -> None:
        """Play or pause; at the end, play from the start."""
        self.playing = not self.playing
        if self.playing and self.time >= self.duration:
            self.time = 0.0

    def seek(self, time: float) -> None:
        """Put the playhead at a time [s], or at the nearest that there is."""
        self.time = min(max(time, 0.0), self.duration)

    def restart(self, duration: float) -> None:
        """Begin another timeline of this length [s]; playing or not, as before."""
        self.duration, self.time = max(duration, 0.0), 0.0
