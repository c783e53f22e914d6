"""Curves over time in the panel, with a mark where the playhead is."""

from collections.abc import Sequence

import numpy as np
from viser import GuiApi, uplot

from artigrasp.arrays import Array
from artigrasp.kernels.layout import HANDS
from artigrasp.viewer.recording import Recording

COLOURS = ("#2f7fc1", "#e07b39", "#34b27b", "#b0569c", "#8a6fd1", "#c2a022", "#4fb3bf", "#d0495b", "#6b7280", "#8d6e4b")
NOW = "#9aa3ad"
HEIGHT = 170
"""Of a plot [px]."""
MOST_POINTS = 600
"""Of a curve: more would only cost time."""

PLOTS = {
    "hinge angle [deg]": ("hinge angle", "target"),
    "force on the hands [N]": tuple(f"force {side}" for side in HANDS),
}


class Plots:
    """Plots of a recording.

    Their curves are the same for every recording, zero where one lacks them: viser's page does not survive that a plot
    is taken away.
    """

    def __init__(self, gui: GuiApi, reward_terms: Sequence[str]) -> None:
        """Put them where the panel is being filled, with these terms of the reward if there are any."""
        plots = PLOTS | ({"terms of the reward": tuple(reward_terms)} if reward_terms else {})
        self._plots = [
            (
                names,
                gui.add_uplot(
                    data=tuple(np.zeros(2) for _ in range(len(names) + 2)),
                    series=(
                        uplot.Series(label="s"),
                        uplot.Series(label="now", stroke=NOW, width=1),
                        *(
                            uplot.Series(label=name.removeprefix("force ").replace("_", " "), stroke=colour, width=1.5)
                            for name, colour in zip(names, COLOURS * 2, strict=False)
                        ),
                    ),
                    title=title,
                    scales={"x": uplot.Scale(time=False)},
                    height=HEIGHT,
                ),
            )
            for title, names in plots.items()
        ]

    def show(self, recording: Recording, target: float | None, time: float) -> None:
        """Draw the curves of a recording so far.

        Args:
            recording: The recording.
            target: Hinge angle to reach [rad], None if there is none.
            time: Where the playhead is [s].
        """
        times, curves = recording.curves()
        if len(times) < 2:
            return
        if target is not None:
            curves["target"] = np.full(len(times), np.degrees(target))
        step = -(-len(times) // MOST_POINTS)
        for names, plot in self._plots:
            columns = [curves.get(name, np.zeros(len(times)))[::step] for name in names]
            plot.data = (times[::step], now_mark(times[::step], columns, time), *columns)


def now_mark(times: Array, columns: list[Array], time: float) -> Array:
    """A curve along the lower border of others that goes to their upper one at a time [s]."""
    values = np.stack(columns)
    mark = np.full(len(times), values.min())
    mark[min(int(np.searchsorted(times, time)), len(times) - 1)] = values.max()
    return mark
