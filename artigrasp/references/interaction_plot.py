"""A picture of what the rules of extraction look at in one recording, and of what they find."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np

from artigrasp.config.extraction import ExtractionConfig
from artigrasp.files import atomic_write
from artigrasp.kernels.layout import HANDS, LINK_COUNT
from artigrasp.references.agreement import Pair
from artigrasp.references.extraction import Extraction
from artigrasp.references.interactions import FRAME_RATE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

COLOURS = {
    "right_arti": "#d55e00",
    "left_arti": "#cc79a7",
    "two_arti": "#7f4f24",
    "right_grasp": "#0072b2",
    "left_grasp": "#e69f00",
    "two_grasp": "#009e73",
}
"""Of what hands do."""
HOLDING, TURNING = "#9aa5b1", "#3d4852"
"""Of links that touch the object, and of those among them that touch the articulated part."""
SHADE = "#faf6c8"
"""Of what is faster than its threshold."""


def plot_interactions(extraction: Extraction, pairs: Iterable[Pair], config: ExtractionConfig, path: Path) -> None:
    """Draw speed of the base, hinge angle and contacts of each hand over time, with interactions and labels.

    Args:
        extraction: What was found in a recording.
        pairs: The authors' labels of it, paired with that; may be none.
        config: The rules' numbers.
        path: The picture.
    """
    matplotlib.use("Agg")
    from matplotlib import pyplot

    signals, pairs = extraction.signals, list(pairs)
    frames = np.arange(len(signals.base_speed))
    with atomic_write(path) as temporary:
        figure, axes = pyplot.subplots(
            5, 1, figsize=(13, 8.5), sharex=True, layout="constrained", height_ratios=(1.3, 1.3, 1, 1, 1.3)
        )
        speed, hinge, *contacts, rows = axes
        speed.plot(frames, signals.base_speed, color="black", linewidth=1)
        speed.axhline(config.base_speed, color="black", linewidth=0.8, linestyle=":")
        _shade(speed, signals.base_speed > config.base_speed)
        speed.set_ylabel("speed of the\nbase [m/s]")
        lifted = speed.twinx()
        lifted.plot(frames, 100 * signals.height, color=COLOURS["right_grasp"], linewidth=1)
        lifted.set_ylabel("height [cm]", color=COLOURS["right_grasp"])
        hinge.plot(frames, signals.hinge_angle, color="black", linewidth=1)
        _shade(hinge, np.abs(signals.hinge_rate) > config.hinge_rate)
        low, high = hinge.get_ylim()
        hinge.set_ylim(min(low, -0.05), max(high, 1.0))
        hinge.set_ylabel("hinge angle\n[rad]")
        for hand, axis in enumerate(contacts):
            axis.fill_between(frames, signals.holding_links[:, hand], color=HOLDING, linewidth=0)
            axis.fill_between(frames, signals.turning_links[:, hand], color=TURNING, linewidth=0)
            axis.set_ylim(0, LINK_COUNT)
            axis.set_ylabel(f"links of the\n{HANDS[hand]} hand")
        _draw_interactions(rows, extraction, pairs)
        for axis in axes[:-1]:
            for each in extraction.interactions:
                axis.axvline(each.frame, color=COLOURS[each.task], linewidth=1)
            for pair in pairs:
                if pair.label is not None:
                    axis.axvline(pair.label.frame, color=COLOURS[pair.label.task], linewidth=1.2, linestyle="--")
        figure.legend(handles=_legend(config), loc="outside lower center", ncols=6, fontsize=8, frameon=False)
        rows.set_xlim(0, len(frames) - 1)
        rows.set_xlabel(f"frame, {FRAME_RATE:g} per second")
        subject, sequence, reconstructed = extraction.recording
        what = ", hands reconstructed from images" if reconstructed else ""
        figure.suptitle(f"{sequence} of {subject}{what}")
        figure.savefig(temporary, dpi=120)
        pyplot.close(figure)


def _draw_interactions(axis: "Axes", extraction: Extraction, pairs: list[Pair]) -> None:
    """Bars from first to last frame with a triangle at the frame chosen; the authors' frames as circles above."""
    tasks = [task for task in COLOURS if task in _tasks(extraction, pairs)]
    for each in extraction.interactions:
        y, colour = tasks.index(each.task), COLOURS[each.task]
        axis.plot([each.first, each.last], [y, y], color=colour, linewidth=5, alpha=0.4, solid_capstyle="butt")
        axis.plot(each.frame, y, marker="^", color=colour, markersize=8)
    for pair in pairs:
        if pair.label is not None:
            y, colour = tasks.index(pair.label.task), COLOURS[pair.label.task]
            agrees = pair.interaction is not None
            axis.plot(pair.label.frame, y, "o", markersize=11, markeredgewidth=2, color=colour, fillstyle="none")
            if not agrees:
                axis.plot(pair.label.frame, y, "x", markersize=11, markeredgewidth=2, color=colour)
    axis.set_yticks(range(len(tasks)), [task.replace("_", " ") for task in tasks])
    axis.set_ylim(len(tasks) - 0.5, -0.5)
    axis.grid(axis="x", alpha=0.3)


def _legend(config: ExtractionConfig) -> "list[Artist]":
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color="grey", marker="^", markersize=7, label="found here, frame chosen"),
        Line2D([], [], color="grey", linestyle="--", marker="o", fillstyle="none", label="labelled by the authors"),
        Line2D([], [], color="grey", linestyle="--", marker="x", label="labelled, but not found"),
        Patch(color=SHADE, label=f"faster than {config.base_speed:g} m/s or {config.hinge_rate:g} rad/s"),
        Patch(color=HOLDING, label="links on the object"),
        Patch(color=TURNING, label="links on the articulated part"),
    ]


def _tasks(extraction: Extraction, pairs: list[Pair]) -> set[str]:
    return {each.task for each in extraction.interactions} | {
        each.label.task for each in pairs if each.label is not None
    }


def _shade(axis: "Axes", mask: np.ndarray) -> None:
    axis.fill_between(
        np.arange(len(mask)),
        0,
        1,
        where=mask,
        transform=axis.get_xaxis_transform(),
        color=SHADE,
        zorder=0,
        linewidth=0,
    )
